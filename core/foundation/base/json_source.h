// JSON from a user's file, with the place of every value, so that errors can point at it.
//
// Use it for files people write (suites, scene files, manifests). parsed_json is enough for what our own programs
// wrote.
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"

namespace relign {

using Json = nlohmann::json;

// Deeper lists and objects in each other are refused: whatever walks over a value calls itself as often.
inline constexpr std::size_t kDeepestJson = 200;

// The value, or a discarded one for what is no JSON, or nested deeper than kDeepestJson or `deepest`.
Json parsed_json(std::string_view text, std::size_t deepest = kDeepestJson);

class JsonSource {
 public:
  // Reads and parses. Throws Error: io when unreadable, bad_input with file:line:column when it is no JSON or nested
  // deeper than kDeepestJson, when an object names a key twice, or for a file of more than 256 MB. The root may be of
  // any type.
  static JsonSource from_file(const std::filesystem::path& path);
  static JsonSource from_text(std::string text, std::string file_name);

  const Json& root() const { return root_; }
  const std::string& file() const { return file_; }
  const std::string& text() const { return text_; }  // verbatim

  // A problem at a value (JSON pointer, "" is the root).
  Problem problem(const std::string& pointer, const std::string& message) const;

 private:
  struct Places;
  std::string file_;
  std::string text_;
  Json root_;
  std::shared_ptr<const Places> places_;
};

// Reads the members of one object and remembers every mistake: wrong types, missing or unknown
// keys. Getters return the fallback after a mistake, so that all mistakes come out at once.
class ObjectReader {
 public:
  // `object` is what stands at `pointer`; if it is no object, that is a problem and all is absent.
  ObjectReader(const JsonSource& source, std::string pointer, std::vector<Problem>& problems);

  bool has(const std::string& key) const;
  const Json* get(const std::string& key);  // null when absent; marks the key as known
  double number(const std::string& key, double fallback, double minimum, double maximum);
  double required_number(const std::string& key, double minimum, double maximum);
  std::int64_t integer(const std::string& key, std::int64_t fallback, std::int64_t minimum, std::int64_t maximum);
  std::string string(const std::string& key, const std::string& fallback);
  std::string required_string(const std::string& key);
  bool boolean(const std::string& key, bool fallback);
  std::vector<double> numbers(const std::string& key, std::size_t count, const std::vector<double>& fallback);

  std::string pointer_to(const std::string& key) const;
  void complain(const std::string& key, const std::string& message);  // empty key: the object itself
  // Call last: every member that nobody asked for is a problem ("$schema" is allowed).
  void refuse_unknown();

 private:
  const Json* member(const std::string& key, const char* type, bool required);
  const JsonSource& source_;
  std::string pointer_;
  std::vector<Problem>& problems_;
  const Json* object_ = nullptr;
  std::vector<std::string> known_;
};

// Keys sorted, no spaces, shortest numbers: equal values give equal text.
std::string canonical_json(const Json& value);

}  // namespace relign
