// Text from results is written by strangers: plugins, suites and messages may hold markup or
// terminal sequences. Everything that leaves this room passes through one of these.
#pragma once

#include <string>
#include <string_view>

#include "base/json_source.h"

namespace relign {

// For HTML text and quoted attributes: & < > " ' are replaced, control characters become U+FFFD.
std::string html_escaped(std::string_view text);

// JSON that can stand inside <script>: < > & are written as \u escapes, so that no content can end
// the element or open a comment.
std::string json_for_script(const Json& value);

// For a terminal: control characters (C0, DEL, C1) become '?', so that a name cannot move the cursor.
std::string terminal_text(std::string_view text);

// For a cell of a Markdown table: what would be markup is escaped, control characters and line ends become '?'.
std::string markdown_text(std::string_view text);

// A field of a CSV file (RFC 4180): control characters become '?', and what a spreadsheet would take for a formula
// (a text that begins with = + - @) gets an apostrophe before it.
std::string csv_field(std::string_view text);

// Columns the text takes, one per code point; and the text cut to that many with "..." at its end.
std::size_t columns(std::string_view text);
std::string clipped(std::string_view text, std::size_t most_columns);

std::string base64(std::string_view bytes);

}  // namespace relign
