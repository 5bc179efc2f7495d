#include "report/sections.h"

#include <algorithm>

#include "base/json_members.h"
#include "base/text.h"

namespace relign::report {

std::string number_text(const Json& number, int digits) {
  if (number.is_number_unsigned()) return std::to_string(number.get<std::uint64_t>());
  return number.is_number() ? significant(number.get<double>(), digits) : "-";
}

std::string joined(const Json& list, const std::string& separator) {
  std::string out;
  for (const Json& item : list)
    out += (out.empty() ? "" : separator) + (item.is_string() ? item.get<std::string>() : item.dump());
  return out;
}

bool any_group(const Json& data, const char* flag) {
  const Json& groups = data["groups"];
  return std::any_of(groups.begin(), groups.end(), [flag](const Json& group) { return flag_of(group, flag); });
}

bool every_group(const Json& data, const char* flag) {
  const Json& groups = data["groups"];
  return std::all_of(groups.begin(), groups.end(), [flag](const Json& group) { return flag_of(group, flag); });
}

std::string sort_value(const Json& number) { return number.is_number() ? shortest(number.get<double>()) : ""; }

bool any_row(const Json& data, const char* member) {
  for (const Json& group : data["groups"])
    for (const Json& row : group["rows"])
      if (!object_of(row, member).empty()) return true;
  return false;
}

}  // namespace relign::report
