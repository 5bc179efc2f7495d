#include "records/checksum.h"

#include "base/hash.h"

namespace relign::records {
namespace {

constexpr std::string_view kStart = ",\"sha256\":\"", kEnd = "\"}";
constexpr std::size_t kDigits = 64, kLength = kStart.size() + kDigits + kEnd.size();

}  // namespace

std::string with_checksum(std::string_view lines) {
  const std::string hash = sha256_hex(std::string(lines) + "\n");
  std::string sealed(lines.substr(0, lines.size() - 1));  // all but the brace
  return sealed.append(kStart).append(hash).append(kEnd);
}

SealedLine split_checksum(std::string_view line) {
  if (line.size() >= kLength) {
    const std::string_view tail = line.substr(line.size() - kLength);
    const std::string_view digits = tail.substr(kStart.size(), kDigits);
    if (tail.substr(0, kStart.size()) == kStart && tail.substr(kStart.size() + kDigits) == kEnd &&
        digits.find_first_not_of("0123456789abcdef") == std::string_view::npos)
      return {line.substr(0, line.size() - kLength), digits};
  }
  return {line, {}};
}

std::string without_checksum(std::string_view lines) {
  const bool newline = !lines.empty() && lines.back() == '\n';
  const SealedLine split = split_checksum(lines.substr(0, lines.size() - (newline ? 1 : 0)));
  if (split.checksum.empty()) return std::string(lines);
  return std::string(split.body) + (newline ? "}\n" : "}");
}

bool line_is_intact(std::string_view line) {
  const SealedLine split = split_checksum(line);
  return !split.checksum.empty() && sha256_hex(std::string(split.body) + "}\n") == split.checksum;
}

}  // namespace relign::records
