// Characters of untrusted text that are not seen themselves but change how the text around them is shown.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace relign {

struct Character {
  std::uint32_t code = 0;  // code point; of invalid UTF-8 the first byte
  std::size_t bytes = 0;   // 0: invalid UTF-8

  // Control characters, separators of lines, marks that change the writing direction, characters that are not seen and
  // make two names look equal, and invalid UTF-8. Joiners of letters and variants of characters are none of these.
  bool hidden() const {
    const auto between = [this](std::uint32_t first, std::uint32_t last) { return code >= first && code <= last; };
    if (bytes == 1 || code < 0xA0) return bytes == 0 || code < 0x20 || between(0x7F, 0x9F);
    return code == 0xAD || code == 0x34F || code == 0x61C || code == 0x180E || code == 0x200B || code == 0x2800 ||
           code == 0x3164 || between(0xFFF9, 0xFFFB) || between(0xE0000, 0xE0FFF) || between(0x200E, 0x200F) ||
           between(0x2028, 0x202E) || between(0x2060, 0x2069) || code == 0xFEFF || bytes == 0;
  }
};

// The first character of a text that is not empty.
Character character_at(std::string_view text);

// For a text that is shown in one line: what it has and must not, or an empty string.
std::string line_mistake(std::string_view text);

// What a name must not have, besides hidden characters, since readers compare it with others by eye: it must not mix
// Latin with Greek, Cyrillic or Armenian letters, consist of those of one of these that look like Latin ones, or have
// letters that are made to look like Latin ones (mathematical, full-width, ...).
std::string letters_mistake(std::string_view name);

}  // namespace relign
