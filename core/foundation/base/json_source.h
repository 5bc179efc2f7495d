// JSON from a user's file with the position of every value, so that errors can point at it.
//
// Use it for files that people write (suites, scene files, manifests). For JSON that the program itself wrote,
// parsed_json and json_members.h are enough.
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

// Deeper nesting is rejected, because code that walks over a value recurses once per level.
inline constexpr std::size_t kMaxJsonDepth = 200;

// All JSON is read by the functions of this header: they refuse an object that has a key twice, of which readers take
// the first or the last.

// The parsed value; a discarded one (is_discarded()) if the text is not JSON, has a key twice or is nested deeper than
// kMaxJsonDepth or `deepest`.
Json parsed_json(std::string_view text, std::size_t deepest = kMaxJsonDepth);

// The same; throws Error(bad_input): "invalid JSON at line 1, column 7: duplicate key 'step'".
Json valid_json(std::string_view text);

class JsonSource {
 public:
  // Reads and parses; the root may have any type. Throws Error: io if unreadable; bad_input with file:line:column for
  // invalid JSON, nesting deeper than kMaxJsonDepth and duplicate keys, and for files larger than 256 MB.
  static JsonSource from_file(const std::filesystem::path& path);
  static JsonSource from_text(std::string text, std::string file_name);
  // A value without text: problems have no line.
  static JsonSource from_value(Json value, std::string file_name);

  const Json& root() const { return root_; }
  const std::string& file() const { return file_; }
  const std::string& text() const { return text_; }  // verbatim

  // A problem at the value with this JSON pointer ("" is the root).
  Problem problem(const std::string& pointer, const std::string& message) const;

 private:
  struct Places;
  std::string file_;
  std::string text_;
  Json root_;
  std::shared_ptr<const Places> places_;
};

// Reads the members of one object and collects every mistake: wrong types, missing or unknown keys.
// Getters return the fallback after a mistake, so that all mistakes of a file are reported at once.
class ObjectReader {
 public:
  // Reads the value at `pointer`. If it is not an object, that is a problem and every member is absent.
  ObjectReader(const JsonSource& source, std::string pointer, std::vector<Problem>& problems);

  bool has(const std::string& key) const;
  const Json* get(const std::string& key);  // null if absent; marks the key as known
  double number(const std::string& key, double fallback, double minimum, double maximum);
  double required_number(const std::string& key, double minimum, double maximum);
  std::int64_t integer(const std::string& key, std::int64_t fallback, std::int64_t minimum, std::int64_t maximum);
  std::string string(const std::string& key, const std::string& fallback);
  std::string required_string(const std::string& key);
  bool boolean(const std::string& key, bool fallback);
  std::vector<double> numbers(const std::string& key, std::size_t count, const std::vector<double>& fallback);

  std::string pointer_to(const std::string& key) const;
  void complain(const std::string& key, const std::string& message);           // empty key: at the object itself
  void complain_missing(const std::string& key, const std::string& expected);  // "missing key 'KEY' (EXPECTED)"
  // Call last: every member that was not read is a problem ("$schema" is allowed).
  void reject_unknown();

 private:
  const Json* member(const std::string& key, const char* type, bool required);
  const JsonSource& source_;
  std::string pointer_;
  std::vector<Problem>& problems_;
  const Json* object_ = nullptr;
  std::vector<std::string> known_;
};

// At most 60 characters of the value, for messages.
std::string shown(const Json& value);

// The key as a word of a JSON pointer.
std::string pointer_word(const std::string& key);

// Keys sorted, no spaces, shortest numbers: equal values give equal text.
std::string canonical_json(const Json& value);

}  // namespace relign
