// Design programs' files as lines of UTF-8, and the words and numbers in them.
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

// UTF-16 (with a byte order mark, or told by its zero bytes), UTF-8 or Latin-1. Throws Error(bad_input) that names
// the file for an empty one, one that is too long, and one that is no text.
std::vector<TextLine> text_lines(std::string_view bytes, const std::string& file);

// Words between blanks; quotes ("..." or '...') keep blanks together and are taken off.
std::vector<std::string> words_of(const std::string& text);

// Decimal comma or point, exponents with E or D. Nothing for what is no finite number.
std::optional<double> parse_number(const std::string& word);

// The nearest number that `digits` decimal digits write: 0.3 stays 0.3.
double rounded(double value, int digits);

std::string upper_case(std::string text);
std::string trimmed(const std::string& text);
// At most `most` bytes, with "..." and no control characters: for messages.
std::string shown(const std::string& text, std::size_t most);

}  // namespace relign::lens_files
