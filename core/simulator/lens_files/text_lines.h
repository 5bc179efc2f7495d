// Splits design programs' files into lines of UTF-8, words and numbers.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace relign::lens_files {

struct TextLine {
  int number = 0;  // from 1
  std::string text;
};

// Decodes UTF-16 (by its byte order mark or its zero bytes), UTF-8 or Latin-1. Throws Error(bad_input) with the file's
// name if it is empty, too long or not text.
std::vector<TextLine> text_lines(std::string_view bytes, const std::string& file);

// Words between blanks; quotes ("..." or '...') protect blanks and are removed.
std::vector<std::string> words_of(const std::string& text);

// Decimal comma or point, exponents with E or D. Empty if not a finite number.
std::optional<double> parse_number(const std::string& word);

// Rounds to `digits` significant decimal digits: 0.3 stays 0.3.
double rounded(double value, int digits);

std::string upper_case(std::string text);
std::string trimmed(const std::string& text);
// For messages: without control characters, cut to `most` bytes and "...".
std::string shown(const std::string& text, std::size_t most);

}  // namespace relign::lens_files
