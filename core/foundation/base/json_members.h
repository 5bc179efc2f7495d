// Tolerant access to JSON that the program itself wrote. For files that people write use ObjectReader (json_source.h),
// which reports every mistake.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace relign {

using Json = nlohmann::json;

Json number_or_null(double value);  // null if it is not finite

// Members that may be missing or, in a damaged file, have another type. Returned references live as long as `object`.
const Json& member(const Json& object, const char* key);      // null if missing
std::string text_of(const Json& object, const char* key);     // "" if missing; other types as JSON text
std::uint64_t count_of(const Json& object, const char* key);  // 0 if missing
bool flag_of(const Json& object, const char* key);            // false if missing
const Json& list_of(const Json& object, const char* key);     // an empty list if missing
const Json& object_of(const Json& object, const char* key);   // an empty object if missing

}  // namespace relign
