#include "base/json_members.h"

#include <cmath>

#include "base/text.h"

namespace relign {

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }

const Json& member(const Json& object, const char* key) {
  static const Json kNone;
  if (!object.is_object()) return kNone;
  const auto found = object.find(key);
  return found == object.end() ? kNone : *found;
}

std::string text_of(const Json& object, const char* key) {
  const Json& found = member(object, key);
  if (found.is_null()) return "";
  return found.is_string() ? found.get<std::string>() : found.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::uint64_t count_of(const Json& object, const char* key) {
  const Json& found = member(object, key);
  return found.is_number_unsigned() ? found.get<std::uint64_t>() : 0;
}

bool flag_of(const Json& object, const char* key) {
  const Json& found = member(object, key);
  return found.is_boolean() && found.get<bool>();
}

const Json& list_of(const Json& object, const char* key) {
  static const Json kNone = Json::array();
  const Json& found = member(object, key);
  return found.is_array() ? found : kNone;
}

const Json& object_of(const Json& object, const char* key) {
  static const Json kNone = Json::object();
  const Json& found = member(object, key);
  return found.is_object() ? found : kNone;
}

}  // namespace relign
