// Formats names and numbers for messages and files.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace relign {

// Shortest text that parses to the same double; independent of the locale.
std::string shortest(double value);

// `value` with `digits` significant digits, without exponent between 1e-4 and 1e6; "-" for NaN.
std::string significant(double value, int digits = 3);

// `value` with `decimals` digits after the point, without exponent; independent of the locale.
std::string fixed(double value, int decimals);

// The text made safe for a terminal, a log or a page: hidden characters (characters.h) other than line ends and tabs
// are replaced by escapes such as \x1b and \u202e.
std::string printable(std::string_view text);

// The name with '_' replaced by '-': users may type either.
std::string normalised_name(std::string_view name);

// The most similar name in `known` by edit distance; empty if none is similar.
std::string nearest_name(std::string_view name, const std::vector<std::string>& known);

// "; did you mean 'x'?" or, without a similar name, "; allowed: a, b, c".
std::string suggestion(std::string_view name, const std::vector<std::string>& known);

// Two lower-case digits per byte. from_hex throws Error(bad_input) for anything else.
std::string to_hex(std::string_view bytes);
std::string from_hex(std::string_view digits);

// "1 trial", "2 trials".
std::string counted(std::uint64_t count, const std::string& noun);

std::string in_quotes(const std::string& text);

std::string join(const std::vector<std::string>& parts, std::string_view separator);

}  // namespace relign
