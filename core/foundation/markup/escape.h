// Escapes text for HTML, Markdown, CSV and terminals. Names and messages of plugins and suites are untrusted and may
// contain markup or terminal sequences, so that everything the report writes passes through one of these functions.
#pragma once

#include <string>
#include <string_view>

#include "base/json_source.h"

namespace relign {

// For HTML text and quoted attributes: & < > " ' are escaped, hidden characters (base/characters.h) become U+FFFD.
std::string html_escaped(std::string_view text);

// JSON for embedding in <script>: < > & are written as \u escapes, so that no content can end the element
// or open a comment.
std::string json_for_script(const Json& value);

// For a terminal: hidden characters become '?', so that a name cannot move the cursor or reorder the line.
std::string terminal_text(std::string_view text);

// For a cell of a Markdown table: markup is escaped, hidden characters become '?'.
std::string markdown_text(std::string_view text);

// For a field of a CSV file (RFC 4180): hidden characters become '?', and text that a spreadsheet would read as a
// formula (it begins with = + - @) is prefixed with an apostrophe.
std::string csv_field(std::string_view text);

// Width of the text in columns, one per code point; and the text truncated to that many, with "..." at its end.
std::size_t columns(std::string_view text);
std::string clipped(std::string_view text, std::size_t most_columns);

std::string base64(std::string_view bytes);

}  // namespace relign
