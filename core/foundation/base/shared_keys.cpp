#include "base/shared_keys.h"

#include <map>
#include <string>

#include "base/json_members.h"
#include "base/schema.h"

extern "C" {
extern const unsigned char relign_schema_spec[];
extern const unsigned long relign_schema_spec_size;
}

namespace relign {
namespace {

// What relates several keys: some limit, and no field twice.
void check_field_mtf(const JsonSource& source, const std::string& pointer, std::vector<Problem>& problems) {
  const Json& field_mtf = source.root().at(Json::json_pointer(pointer));
  const auto has_limit = [](const Json& of) { return of.contains("tangential") || of.contains("sagittal"); };
  bool any = has_limit(field_mtf);
  std::map<std::string, std::string> places;  // pointers by name
  const Json& fields = list_of(field_mtf, "fields");
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const std::string place = pointer + "/fields/" + std::to_string(i);
    const std::string name = fields[i].is_string() ? fields[i].get<std::string>() : text_of(fields[i], "name");
    any = any || has_limit(fields[i]);
    const auto [first, is_new] = places.emplace(name, place);
    if (is_new || name.empty()) continue;
    const Problem before = source.problem(first->second, "");
    problems.push_back(source.problem(place, "duplicate field '" + name + "', already listed at line " +
                                                 std::to_string(before.line) + ", column " +
                                                 std::to_string(before.column)));
  }
  if (!any)
    problems.push_back(source.problem(pointer, "expected a limit: 'tangential' or 'sagittal', here or in 'fields'"));
}

}  // namespace

MachineTimeKeys read_machine_time(const JsonSource& source, const std::string& pointer,
                                  std::vector<Problem>& problems) {
  constexpr double kSlowest = 1e-9, kLargest = 1e9;
  ObjectReader reader(source, pointer, problems);
  const auto number = [&reader](const char* key, double smallest) -> std::optional<double> {
    if (!reader.has(key)) {
      reader.get(key);  // marks it as known
      return std::nullopt;
    }
    return reader.number(key, smallest, smallest, kLargest);
  };
  MachineTimeKeys found;
  found.speed_mm_per_s = number("speed_mm_per_s", kSlowest);
  found.speed_deg_per_s = number("speed_deg_per_s", kSlowest);
  found.settle_ms = number("settle_ms", 0);
  found.exposure_ms = number("exposure_ms", 0);
  found.readout_ms = number("readout_ms", 0);
  reader.reject_unknown();
  return found;
}

void check_specification(const JsonSource& source, const std::string& pointer, std::vector<Problem>& problems) {
  static const Schema schema(relign_schema_spec, relign_schema_spec_size);
  schema.checked(source, pointer, "", problems);
  if (const std::string place = pointer + "/field_mtf"; source.root().contains(Json::json_pointer(place)))
    check_field_mtf(source, place, problems);
}

}  // namespace relign
