// Small helpers for names and numbers in messages and files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace relign {

// Shortest text that reads back as the same double; independent of the locale.
std::string shortest(double value);

// A number for people: `digits` significant digits, no exponent between 1e-4 and 1e6.
std::string significant(double value, int digits = 3);

// The text as a terminal, a log or a page may have it: control characters but line ends and tabs, marks that turn the
// direction of writing, and bytes that are no UTF-8 become \x1b or \u202e.
std::string printable(std::string_view text);

// `-` equals `_` in every name a user types.
std::string normalised_name(std::string_view name);

// The most similar of `known` if it is similar enough, else empty.
std::string nearest_name(std::string_view name, const std::vector<std::string>& known);

// "; did you mean 'x'?" or, without a similar name, "; known: a, b, c".
std::string suggestion(std::string_view name, const std::vector<std::string>& known);

// Two lower-case digits a byte. from_hex throws Error(bad_input) for anything else.
std::string to_hex(std::string_view bytes);
std::string from_hex(std::string_view digits);

std::string join(const std::vector<std::string>& parts, std::string_view separator);

}  // namespace relign
