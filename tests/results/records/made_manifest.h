// Manifests for tests, from the members that matter to them.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "records/manifest.h"

namespace relign::records {

template <Described T>
Json completed(const Json& partial);

template <class Value>
Json completed_value(const Json& json, const Value&) {
  if constexpr (Described<Value>) return json.is_object() ? completed<Value>(json) : json;
  return json;
}
template <class Value>
Json completed_value(const Json& json, const std::optional<Value>&) {
  return completed_value(json, Value());
}
template <class Value>
Json completed_value(Json json, const std::vector<Value>&) {
  if (json.is_array())
    for (Json& one : json) one = completed_value(one, Value());
  return json;
}

// With the defaults of the members that `partial` lacks.
template <Described T>
Json completed(const Json& partial) {
  const T usual{};
  Json json = json_of(usual);
  json.update(partial);
  T::members(
      [&](const Member& member, const auto& value) {
        if (const auto given = partial.find(member.key); given != partial.end())
          json[std::string(member.key)] = completed_value(*given, value);
      },
      usual);
  return json;
}

inline Manifest made_manifest(const Json& partial) {
  return read_described<Manifest>(completed<Manifest>(partial), "the test's manifest");
}

}  // namespace relign::records
