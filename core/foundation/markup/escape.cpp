#include "markup/escape.h"

#include <algorithm>

#include "base/characters.h"

namespace relign {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

bool continues(char byte) { return (static_cast<unsigned char>(byte) & 0xc0) == 0x80; }

}  // namespace

std::string html_escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size() + text.size() / 8);
  for (std::size_t i = 0; i < text.size();) {
    const Character next = character_at(text.substr(i));
    switch (const char c = text[i]) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      case '\n':
      case '\t':
        out += c;
        break;
      case '\r':
        break;
      default:
        out += next.hidden() ? kReplacement : text.substr(i, next.bytes);
    }
    i += std::max<std::size_t>(next.bytes, 1);
  }
  return out;
}

std::string json_for_script(const Json& value) {
  const std::string plain = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string out;
  out.reserve(plain.size());
  for (const char c : plain) {
    switch (c) {  // occur only inside JSON strings, where an escape has the same meaning
      case '<':
        out += "\\u003c";
        break;
      case '>':
        out += "\\u003e";
        break;
      case '&':
        out += "\\u0026";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string markdown_text(std::string_view text) {
  const std::string plain = terminal_text(text);
  std::string out;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const auto alphanumeric = [&](std::size_t at) {
      return at < plain.size() && std::isalnum(static_cast<unsigned char>(plain[at])) != 0;
    };
    // Inside a word, as in many names, an underscore is not markup.
    const bool in_word = plain[i] == '_' && i > 0 && alphanumeric(i - 1) && alphanumeric(i + 1);
    if (std::string_view("\\`*_<>&[]|~!").find(plain[i]) != std::string_view::npos && !in_word) out += '\\';
    out += plain[i];
  }
  return out;
}

std::string csv_field(std::string_view text) {
  std::string plain = terminal_text(text);
  if (!plain.empty() && std::string_view("=+-@").find(plain.front()) != std::string_view::npos) plain.insert(0, "'");
  if (plain.find_first_of(",\"") == std::string::npos) return plain;
  std::string quoted = "\"";
  for (const char c : plain) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

std::string terminal_text(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const Character next = character_at(text);
    if (next.hidden())
      out += '?';
    else
      out += text.substr(0, next.bytes);
    text.remove_prefix(std::max<std::size_t>(next.bytes, 1));
  }
  return out;
}

std::size_t columns(std::string_view text) {
  std::size_t count = 0;
  for (const char c : text) count += continues(c) ? 0 : 1;
  return count;
}

std::string clipped(std::string_view text, std::size_t most_columns) {
  if (columns(text) <= most_columns) return std::string(text);
  const std::size_t keep = most_columns > 3 ? most_columns - 3 : 0;
  std::size_t count = 0, end = 0;
  while (end < text.size()) {
    if (!continues(text[end]) && count++ == keep) break;
    ++end;
  }
  return std::string(text.substr(0, end)) + "...";
}

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned block = 0;
    for (std::size_t k = 0; k < 3; ++k)
      block = block << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += i + k <= bytes.size() ? kDigits[block >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

}  // namespace relign
