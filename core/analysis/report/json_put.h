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

// Members in pairs of name and value: unknown numbers become null, absent optional parts are left out.
inline void put(Json&) {}
template <class Value, class... More>
void put(Json& json, const char* name, const Value& value, const More&... more) {
  if constexpr (std::is_floating_point_v<Value>) {
    json[name] = number(value);
  } else if constexpr (std::is_same_v<Value, std::vector<double>>) {
    Json& list = json[name] = Json::array();
    for (const double one : value) list.push_back(number(one));
  } else if constexpr (requires { value.has_value(); }) {
    if (value) put(json, name, *value);
  } else {
    json[name] = value;
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
