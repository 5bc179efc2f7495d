// Writes the members of JSON documents from structs.
#pragma once

#include <cmath>
#include <type_traits>
#include <vector>

#include "base/json_source.h"
#include "statistics/band.h"

namespace relign::report {

inline Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }
inline Json arrival(double value) { return std::isinf(value) ? Json("never") : number(value); }

// A value: a number, null if it is unknown, a text, a list, or a struct with a function write(Json&, const Struct&).
template <class Value>
void put_value(Json& json, const Value& value) {
  if constexpr (std::is_floating_point_v<Value>)
    json = number(value);
  else if constexpr (requires { write(json, value); })
    write(json, value);
  else
    json = value;
}
template <class Value>
void put_value(Json& json, const std::vector<Value>& list) {
  json = Json::array();
  for (const Value& value : list) put_value(json.emplace_back(nullptr), value);
}

// Members in pairs of name and value. Absent optional parts are left out.
inline void put(Json&) {}
template <class Value, class... More>
void put(Json& json, const char* name, const Value& value, const More&... more) {
  if constexpr (requires { value.has_value(); }) {
    if (value) put_value(json[name], *value);
  } else {
    put_value(json[name], value);
  }
  put(json, more...);
}

// A text, list or object that is left out if it is empty.
template <class Value>
void put_filled(Json& json, const char* name, const Value& value) {
  if (!value.empty()) put(json, name, value);
}

inline void put_interval(Json& json, const statistics::Interval& interval) {
  put(json, "lo95", interval.low, "hi95", interval.high);
}

}  // namespace relign::report
