#include "base/fault.h"

#include <filesystem>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>

#include "base/error.h"

namespace relign {
namespace {

// The part of `text` between `before` and `after`; nullopt if it does not have both.
std::optional<std::string> between(const std::string& text, std::string_view before, std::string_view after) {
  const std::size_t at = text.find(before);
  const std::size_t end = at == std::string::npos ? at : text.find(after, at + before.size());
  if (end == std::string::npos) return std::nullopt;
  return text.substr(at + before.size(), end - at - before.size());
}

}  // namespace

std::string syntax_fault(const std::string& text) {
  // "[json.exception.parse_error.101] parse error at line 3, column 5: syntax error while parsing object - unexpected
  // string literal; expected '}'"
  // "[json.exception.out_of_range.406] number overflow parsing '1e999'"
  if (const auto number = between(text, "number overflow parsing '", "'"))
    return "the number " + *number + " is out of range";
  const std::size_t dash = text.find(" - ");
  return dash == std::string::npos ? "the text is not JSON" : text.substr(dash + 3);
}

std::string json_fault(const nlohmann::json::exception& error) {
  constexpr int kParseError = 101, kOtherType = 302, kNoKey = 403, kOverflow = 406;  // of nlohmann's exceptions
  const std::string text = std::string(error.what()) + "\n";
  if (error.id == kParseError) {
    const std::optional<std::string> place = between(text, "parse error at ", ": ");
    return "invalid JSON" + (place ? " at " + *place : "") + ": " + syntax_fault(error.what());
  }
  if (error.id == kOverflow) return "invalid JSON: " + syntax_fault(error.what());
  const std::optional<std::string> expected = between(text, "type must be ", ", but"),
                                   found = between(text, "but is ", "\n"), key = between(text, "key '", "' not found");
  if (error.id == kOtherType && expected && found) return "expected " + *expected + ", found " + *found;
  if (error.id == kNoKey && key) return "missing key '" + *key + "'";
  return "a value of the wrong type";
}

std::string fault_text(const std::exception& error) {
  if (dynamic_cast<const Error*>(&error)) return error.what();
  if (dynamic_cast<const std::bad_alloc*>(&error)) return "out of memory";
  if (const auto* json = dynamic_cast<const nlohmann::json::exception*>(&error)) return json_fault(*json);
  if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error))
    return "cannot access '" + file->path1().string() + "'" +
           (file->path2().empty() ? "" : " or '" + file->path2().string() + "'") + ": " + file->code().message();
  if (const auto* system = dynamic_cast<const std::system_error*>(&error)) return system->code().message();
  return "unexpected exception '" + std::string(error.what()) + "'; please report it with the command";
}

}  // namespace relign
