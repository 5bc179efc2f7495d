#include "lens_files/text_lines.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "base/error.h"
#include "lens_files/lens_design.h"

namespace relign::lens_files {
namespace {

void append_utf8(std::string& text, std::uint32_t code) {
  if (code < 0x80) {
    text += static_cast<char>(code);
  } else if (code < 0x800) {
    text += static_cast<char>(0xC0 | code >> 6);
    text += static_cast<char>(0x80 | (code & 0x3F));
  } else if (code < 0x10000) {
    text += static_cast<char>(0xE0 | code >> 12);
    text += static_cast<char>(0x80 | (code >> 6 & 0x3F));
    text += static_cast<char>(0x80 | (code & 0x3F));
  } else {
    text += static_cast<char>(0xF0 | code >> 18);
    text += static_cast<char>(0x80 | (code >> 12 & 0x3F));
    text += static_cast<char>(0x80 | (code >> 6 & 0x3F));
    text += static_cast<char>(0x80 | (code & 0x3F));
  }
}

std::string from_utf16(std::string_view bytes, bool big_endian) {
  constexpr std::uint32_t kUnknown = 0xFFFD;
  std::string text;
  text.reserve(bytes.size() / 2);
  const auto unit = [&](std::size_t i) {
    const auto first = static_cast<unsigned char>(bytes[i]), second = static_cast<unsigned char>(bytes[i + 1]);
    return static_cast<std::uint32_t>(big_endian ? first << 8 | second : second << 8 | first);
  };
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    std::uint32_t code = unit(i);
    if (code >= 0xD800 && code < 0xDC00 && i + 3 < bytes.size() && unit(i + 2) >= 0xDC00 && unit(i + 2) < 0xE000) {
      code = 0x10000 + ((code - 0xD800) << 10) + (unit(i + 2) - 0xDC00);
      i += 2;
    } else if (code >= 0xD800 && code < 0xE000) {
      code = kUnknown;
    }
    append_utf8(text, code);
  }
  return text;
}

bool is_utf8(std::string_view bytes) {
  for (std::size_t i = 0; i < bytes.size();) {
    const auto lead = static_cast<unsigned char>(bytes[i]);
    const std::size_t length = lead < 0x80                   ? 1
                               : lead >= 0xC2 && lead < 0xE0 ? 2
                               : lead >= 0xE0 && lead < 0xF0 ? 3
                               : lead >= 0xF0 && lead < 0xF5 ? 4
                                                             : 0;
    if (length == 0 || i + length > bytes.size()) return false;
    for (std::size_t k = 1; k < length; ++k)
      if ((static_cast<unsigned char>(bytes[i + k]) & 0xC0) != 0x80) return false;
    i += length;
  }
  return true;
}

std::string decoded(std::string_view bytes) {
  const auto starts = [&](std::string_view mark) { return bytes.substr(0, mark.size()) == mark; };
  if (starts("\xFF\xFE")) return from_utf16(bytes.substr(2), false);
  if (starts("\xFE\xFF")) return from_utf16(bytes.substr(2), true);
  if (starts("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  // In these files every second byte of UTF-16 is zero.
  const auto zeros = static_cast<std::size_t>(std::count(bytes.begin(), bytes.end(), '\0'));
  if (zeros > bytes.size() / 3) return from_utf16(bytes, bytes[0] == '\0');
  if (is_utf8(bytes)) return std::string(bytes);
  std::string text;
  for (const char letter : bytes) append_utf8(text, static_cast<unsigned char>(letter));
  return text;
}

bool is_blank(char letter) { return letter == ' ' || letter == '\t' || letter == '\f' || letter == '\v'; }

}  // namespace

std::vector<TextLine> text_lines(std::string_view bytes, const std::string& file) {
  if (bytes.empty()) throw Error(ErrorKind::bad_input, file + ": the file is empty");
  if (bytes.size() > kMaxBytes)
    throw Error(ErrorKind::bad_input, file + ": the file has " + std::to_string(bytes.size() >> 20) +
                                          " MB; lens and glass files have at most " + std::to_string(kMaxBytes >> 20));
  const std::string text = decoded(bytes);
  if (text.find('\0') != std::string::npos)
    throw Error(ErrorKind::bad_input, file + ": expected a text file, found zero bytes");
  std::vector<TextLine> lines;
  int number = 1;
  std::string line;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\n' && text[i] != '\r') {
      line += text[i];
      continue;
    }
    if (text[i] == '\r' && i + 1 < text.size() && text[i + 1] == '\n') ++i;
    lines.push_back({number++, std::move(line)});
    line.clear();
  }
  if (!line.empty()) lines.push_back({number, std::move(line)});
  return lines;
}

std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t i = 0; i < text.size();) {
    if (is_blank(text[i])) {
      ++i;
      continue;
    }
    const char quote = text[i] == '"' || text[i] == '\'' ? text[i] : '\0';
    if (quote != '\0') {
      const std::size_t end = std::min(text.find(quote, i + 1), text.size());
      words.push_back(text.substr(i + 1, end - i - 1));
      i = end + 1;
    } else {
      std::size_t end = i;
      while (end < text.size() && !is_blank(text[end])) ++end;
      words.push_back(text.substr(i, end - i));
      i = end;
    }
  }
  return words;
}

std::optional<double> parse_number(const std::string& word) {
  if (word.empty() || word.size() > 64) return std::nullopt;
  std::string text = word[0] == '+' ? word.substr(1) : word;
  if (text.find('.') == std::string::npos && std::count(text.begin(), text.end(), ',') == 1) text[text.find(',')] = '.';
  for (char& letter : text)
    if (letter == 'd' || letter == 'D') letter = 'e';
  // from_chars accepts "inf" and "nan"; designs do not use them as numbers.
  if (text.find_first_of("0123456789") == std::string::npos) return std::nullopt;
  double value = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end.ptr != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  if (end.ec == std::errc()) return value;
  return std::nullopt;
}

double rounded(double value, int digits) {
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::scientific, digits - 1);
  double result = value;
  if (std::isfinite(value)) std::from_chars(buffer, end.ptr, result);
  return result;
}

std::string upper_case(std::string text) {
  for (char& letter : text)
    if (letter >= 'a' && letter <= 'z') letter = static_cast<char>(letter - 'a' + 'A');
  return text;
}

std::string trimmed(const std::string& text) {
  std::size_t first = 0, last = text.size();
  while (first < last && is_blank(text[first])) ++first;
  while (last > first && is_blank(text[last - 1])) --last;
  return text.substr(first, last - first);
}

std::string shown(const std::string& text, std::size_t most) {
  std::string result;
  for (const char letter : trimmed(text)) {
    // Never cut a multi-byte character.
    if (result.size() >= most && (static_cast<unsigned char>(letter) & 0xC0) != 0x80) return result + "...";
    const auto code = static_cast<unsigned char>(letter);
    result += code < 0x20 || code == 0x7F ? '?' : letter;
  }
  return result;
}

}  // namespace relign::lens_files
