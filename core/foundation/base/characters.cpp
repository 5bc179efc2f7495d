#include "base/characters.h"

#include <algorithm>
#include <array>
#include <utility>

namespace relign {
namespace {

enum class Script { none, latin, greek, cyrillic, armenian, imitation };

struct Range {
  std::uint32_t first, last;
  Script script;
};
// Other scripts have few letters that look like Latin ones, and are mixed with them in ordinary names.
constexpr std::array kRanges = {Range{'A', 'Z', Script::latin},
                                Range{'a', 'z', Script::latin},
                                Range{0xC0, 0xD6, Script::latin},
                                Range{0xD8, 0xF6, Script::latin},
                                Range{0xF8, 0x24F, Script::latin},
                                Range{0x250, 0x2AF, Script::imitation},  // phonetic
                                Range{0x370, 0x3FF, Script::greek},
                                Range{0x400, 0x52F, Script::cyrillic},
                                Range{0x530, 0x58F, Script::armenian},
                                Range{0x13A0, 0x13FF, Script::imitation},  // Cherokee
                                Range{0x1C80, 0x1C8F, Script::cyrillic},
                                Range{0x1D00, 0x1DBF, Script::imitation},  // phonetic
                                Range{0x1E00, 0x1EFF, Script::latin},
                                Range{0x1F00, 0x1FFF, Script::greek},
                                Range{0x2100, 0x214F, Script::imitation},  // letter-like
                                Range{0x2160, 0x2188, Script::imitation},  // Roman numerals
                                Range{0x24B6, 0x24E9, Script::imitation},  // in circles
                                Range{0x2C60, 0x2C7F, Script::latin},
                                Range{0x2C80, 0x2CFF, Script::imitation},  // Coptic
                                Range{0x2DE0, 0x2DFF, Script::cyrillic},
                                Range{0xA4D0, 0xA4FF, Script::imitation},  // Lisu
                                Range{0xA640, 0xA69F, Script::cyrillic},
                                Range{0xA720, 0xA7FF, Script::latin},
                                Range{0xAB30, 0xABBF, Script::imitation},
                                Range{0xFF21, 0xFF5A, Script::imitation},    // full-width
                                Range{0x1D400, 0x1D7FF, Script::imitation},  // mathematical
                                Range{0x1F110, 0x1F189, Script::imitation}};

constexpr std::u32string_view kLikeLatin =
    U"\u0391\u0392\u0395\u0396\u0397\u0399\u039A\u039C\u039D\u039F\u03A1\u03A4\u03A5\u03A7\u03B1\u03B3\u03B9\u03BA"
    U"\u03BD"
    U"\u03BF\u03C1\u03C4\u03C5\u03C7\u03C9\u03DC\u03F2\u03F3\u03F9"
    U"\u0405\u0406\u0408\u0410\u0412\u0415\u0417\u041A\u041C\u041D\u041E\u0420\u0421\u0422\u0423\u0425\u0430\u0435"
    U"\u043A"
    U"\u043C\u043D\u043E\u043F\u0433\u0440\u0441\u0442\u0443\u0445\u0455\u0456\u0457\u0458\u0475\u04AE\u04AF\u04BB"
    U"\u04C0"
    U"\u04CF\u0501\u050C\u051A\u051B\u051C\u051D"
    U"\u054D\u054F\u0555\u0561\u0563\u0566\u0570\u0578\u057D\u0581\u0582\u0585";

Script script_of(std::uint32_t code) {
  const auto* range = std::find_if(kRanges.begin(), kRanges.end(),
                                   [code](const Range& one) { return code >= one.first && code <= one.last; });
  return range == kRanges.end() ? Script::none : range->script;
}

}  // namespace

Character character_at(std::string_view text) {
  const auto first = static_cast<unsigned char>(text.front());
  if (first < 0x80) return {first, 1};
  const std::size_t size = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < size) return {first, 0};
  std::uint32_t code = first & (0x7FU >> size);
  for (std::size_t i = 1; i < size; ++i) {
    const auto next = static_cast<unsigned char>(text[i]);
    if ((next & 0xC0U) != 0x80) return {first, 0};
    code = code << 6U | (next & 0x3FU);
  }
  const bool overlong = (size == 3 && code < 0x800) || (size == 4 && code < 0x10000);
  if (overlong || code > 0x10FFFF || (code >= 0xD800 && code <= 0xDFFF)) return {first, 0};
  return {code, size};
}

std::string line_mistake(std::string_view text) {
  while (!text.empty()) {
    const Character next = character_at(text);
    if (next.hidden()) return "line ends, control characters and marks of the writing direction are not allowed";
    text.remove_prefix(next.bytes);
  }
  return "";
}

std::string letters_mistake(std::string_view name) {
  Script script = Script::none;
  bool like_latin = true;
  while (!name.empty()) {
    const Character next = character_at(name);
    name.remove_prefix(next.bytes);
    const Script own = script_of(next.code);
    if (own == Script::none) continue;
    if (own == Script::imitation || (script != Script::none && own != script))
      return "the letters must be of one script, and none that imitate Latin ones, so that different names look "
             "different";
    script = own;
    like_latin = like_latin && kLikeLatin.find(static_cast<char32_t>(next.code)) != std::u32string_view::npos;
  }
  return script != Script::none && script != Script::latin && like_latin
             ? "its Greek, Cyrillic or Armenian letters all look like Latin ones; use those"
             : "";
}

}  // namespace relign
