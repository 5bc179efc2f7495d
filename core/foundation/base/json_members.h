// Reading JSON that the program itself wrote. Files that people write are read by ObjectReader (json_source.h), which
// collects their mistakes.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace relign {

using Json = nlohmann::json;

// Members that may be missing or, in a damaged file, of another type. References are borrowed from the object.
const Json& member(const Json& object, const char* key);      // null without
std::string text_of(const Json& object, const char* key);     // "" without; numbers as text
std::uint64_t count_of(const Json& object, const char* key);  // 0 without
bool flag_of(const Json& object, const char* key);            // false without
const Json& list_of(const Json& object, const char* key);     // an empty list without
const Json& object_of(const Json& object, const char* key);   // an empty object without

}  // namespace relign
