// Structs that declare their JSON members once: they are written, read and described (JSON Schema) by that declaration.
//
//   struct Shard {
//     std::uint64_t number = 0, of = 1;
//
//     template <class Visit, class... S>
//     static void members(Visit&& visit, S&... s) {
//       visit(Member{"number", "from 0"}, s.number...);
//       visit(Member{"of", "shards of the plan"}, s.of...);
//     }
//   };
//
// Values may be text, truth values, counts, numbers (null if NaN), Json, such structs, and vectors, arrays, maps and
// optionals of these. JsonForm can be specialised for others.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_source.h"

namespace relign {

// How a member is written and what it means.
struct Member {
  std::string_view key, meaning = {};
  unsigned flags = 0;
  std::string_view one_of = {};   // the texts that it may be, separated by spaces; empty: any
  std::string_view pattern = {};  // of a text: for the schema; the code that uses the text checks it
  std::string_view schema = {};   // of Json: where its schema is, "spec.schema.json"
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();

  constexpr bool is(unsigned flag) const { return (flags & flag) != 0; }
};
enum MemberFlag : unsigned {
  kLeftOut = 1,     // not written where empty, NaN or null
  kMayLack = 2,     // always written, but read without it
  kMayBeNull = 4,   // a number, an optional or Json: null if NaN or absent
  kAboveLeast = 8,  // more than `least`
  kAnyObject = 16,  // Json: an object
};

// What is wrong with a document, by place: "/algorithms/0/steps is \"x\"; expected an integer".
class JsonFlaws {
 public:
  static constexpr std::size_t kMost = 20;
  void expected(const std::string& what, const Json& found);
  void add(const std::string& sentence);  // about the current place
  bool any() const { return !texts_.empty(); }
  std::string text() const;  // one line for each of the first kMost

  // While it lives, the current place is below the former one.
  class Below {
   public:
    Below(JsonFlaws& flaws, std::string_view key) : flaws_(flaws), length_(flaws.place_.size()) {
      flaws.place_.append("/").append(key);
    }
    ~Below() { flaws_.place_.resize(length_); }
    Below(const Below&) = delete;
    Below& operator=(const Below&) = delete;

   private:
    JsonFlaws& flaws_;
    std::size_t length_;
  };

 private:
  std::string place_;
  std::vector<std::string> texts_;
};

template <class T>
concept Described = requires(T& object) {
  T::members([](const Member&, auto&) {}, object);
};

// Whether `json` is an integer within the limits of `member` and at most `most`.
bool read_whole(const Member& member, const Json& json, std::uint64_t most, std::uint64_t& value, JsonFlaws& flaws);

// write(value), read(member, json, value, flaws), left_out(value).
template <class T>
struct JsonForm;

template <>
struct JsonForm<bool> {
  static Json write(bool value) { return value; }
  static void read(const Member&, const Json& json, bool& value, JsonFlaws& flaws) {
    if (!json.is_boolean()) return flaws.expected("true or false", json);
    value = json.get<bool>();
  }
  static bool left_out(bool value) { return !value; }
};

template <std::unsigned_integral T>
struct JsonForm<T> {
  static Json write(T value) { return value; }
  static void read(const Member& member, const Json& json, T& value, JsonFlaws& flaws) {
    std::uint64_t read = 0;
    if (!read_whole(member, json, std::numeric_limits<T>::max(), read, flaws)) return;
    value = static_cast<T>(read);
  }
  static bool left_out(T value) { return value == 0; }
};

template <>
struct JsonForm<double> {
  static Json write(double value) { return std::isnan(value) ? Json() : Json(value); }
  static void read(const Member& member, const Json& json, double& value, JsonFlaws& flaws);
  static bool left_out(double value) { return std::isnan(value); }
};

template <>
struct JsonForm<std::string> {
  static Json write(const std::string& value) { return value; }
  static void read(const Member& member, const Json& json, std::string& value, JsonFlaws& flaws);
  static bool left_out(const std::string& value) { return value.empty(); }
};

template <>
struct JsonForm<Json> {
  static Json write(const Json& value) { return value; }
  static void read(const Member& member, const Json& json, Json& value, JsonFlaws& flaws) {
    if (member.is(kAnyObject) && !json.is_object() && !(json.is_null() && member.is(kMayBeNull)))
      return flaws.expected("an object", json);
    value = json;
  }
  static bool left_out(const Json& value) { return value.is_null(); }
};

template <class T>
struct JsonForm<std::optional<T>> {
  static Json write(const std::optional<T>& value) { return value ? JsonForm<T>::write(*value) : Json(); }
  static void read(const Member& member, const Json& json, std::optional<T>& value, JsonFlaws& flaws) {
    if (json.is_null() && member.is(kMayBeNull)) return value.reset();
    JsonForm<T>::read(member, json, value.emplace(), flaws);
  }
  static bool left_out(const std::optional<T>& value) { return !value; }
};

template <class T>
struct JsonForm<std::vector<T>> {
  static Json write(const std::vector<T>& values) {
    Json list = Json::array();
    for (const T& value : values) list.push_back(JsonForm<T>::write(value));
    return list;
  }
  static void read(const Member& member, const Json& json, std::vector<T>& values, JsonFlaws& flaws) {
    if (!json.is_array()) return flaws.expected("a list", json);
    values.clear();
    values.reserve(json.size());
    for (const Json& value : json) {
      const JsonFlaws::Below below(flaws, std::to_string(values.size()));
      JsonForm<T>::read(member, value, values.emplace_back(), flaws);
    }
  }
  static bool left_out(const std::vector<T>& values) { return values.empty(); }
};

template <class T, std::size_t N>
struct JsonForm<std::array<T, N>> {
  static Json write(const std::array<T, N>& values) {
    return JsonForm<std::vector<T>>::write({values.begin(), values.end()});
  }
  static void read(const Member& member, const Json& json, std::array<T, N>& values, JsonFlaws& flaws) {
    std::vector<T> read;
    JsonForm<std::vector<T>>::read(member, json, read, flaws);
    if (read.size() != N) return flaws.expected("a list of " + std::to_string(N), json);
    std::move(read.begin(), read.end(), values.begin());
  }
  static bool left_out(const std::array<T, N>&) { return false; }
};

template <class T>
struct JsonForm<std::map<std::string, T>> {
  static Json write(const std::map<std::string, T>& values) {
    Json object = Json::object();
    for (const auto& [key, value] : values) object[key] = JsonForm<T>::write(value);
    return object;
  }
  static void read(const Member& member, const Json& json, std::map<std::string, T>& values, JsonFlaws& flaws) {
    if (!json.is_object()) return flaws.expected("an object", json);
    values.clear();
    for (const auto& [key, value] : json.items()) {
      const JsonFlaws::Below below(flaws, key);
      JsonForm<T>::read(member, value, values[key], flaws);
    }
  }
  static bool left_out(const std::map<std::string, T>& values) { return values.empty(); }
};

template <Described T>
struct JsonForm<T> {
  static Json write(const T& object) {
    Json json = Json::object();
    T::members(
        [&json]<class V>(const Member& member, const V& value) {
          if (!member.is(kLeftOut) || !JsonForm<V>::left_out(value))
            json[std::string(member.key)] = JsonForm<V>::write(value);
        },
        object);
    return json;
  }
  static void read(const Member&, const Json& json, T& object, JsonFlaws& flaws) {
    if (!json.is_object()) return flaws.expected("an object", json);
    std::vector<std::string_view> known;
    T::members(
        [&]<class V>(const Member& member, V& value) {
          known.push_back(member.key);
          const auto found = json.find(member.key);
          if (found == json.end()) {
            if (!member.is(kLeftOut | kMayLack)) flaws.add("lacks '" + std::string(member.key) + "'");
            return;
          }
          const JsonFlaws::Below below(flaws, member.key);
          JsonForm<V>::read(member, *found, value, flaws);
        },
        object);
    for (const auto& [key, value] : json.items())
      if (std::find(known.begin(), known.end(), key) == known.end()) flaws.add("has the unknown member '" + key + "'");
  }
  static bool left_out(const T&) { return false; }
};

template <class T>
Json json_of(const T& value) {
  return JsonForm<T>::write(value);
}

// Throws Error(bad_input) with every flaw: "FILE is damaged: ...".
void refuse_flaws(const JsonFlaws& flaws, const std::string& file);

template <class T>
T read_described(const Json& json, const std::string& file) {
  T value{};
  JsonFlaws flaws;
  JsonForm<T>::read({}, json, value, flaws);
  refuse_flaws(flaws, file);
  return value;
}

// Calls found(key, value of a, value of b) for every member of `keys` that differs.
template <Described T>
void for_each_differing(const T& a, const T& b, const std::vector<std::string_view>& keys, auto&& found) {
  T::members(
      [&](const Member& member, const auto& of_a, const auto& of_b) {
        if (std::find(keys.begin(), keys.end(), member.key) == keys.end()) return;
        if (const Json one = json_of(of_a), other = json_of(of_b); one != other)
          found(std::string(member.key), one, other);
      },
      a, b);
}

// The first member of `keys` that differs, "" if none does.
template <Described T>
std::string first_differing(const T& a, const T& b, const std::vector<std::string_view>& keys) {
  std::string first;
  for_each_differing(a, b, keys, [&first](const std::string& key, const Json&, const Json&) {
    if (first.empty()) first = key;
  });
  return first;
}

// "key: 1 in a, 2 in b" for every member of `keys` that differs.
template <Described T>
std::vector<std::string> differing(const T& a, const T& b, const std::vector<std::string_view>& keys,
                                   const std::string& in_a, const std::string& in_b) {
  std::vector<std::string> messages;
  for_each_differing(a, b, keys, [&](const std::string& key, const Json& one, const Json& other) {
    messages.push_back(key + ": " + one.dump() + " in " + in_a + ", " + other.dump() + " in " + in_b);
  });
  return messages;
}

}  // namespace relign
