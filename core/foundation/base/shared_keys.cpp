#include "base/shared_keys.h"

#include <limits>
#include <map>
#include <string>

#include "base/criteria.h"

namespace relign {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// {"lp_per_mm", "tangential", "sagittal", "fields": [name or {"name", "tangential", "sagittal"}, ...]}
void check_field_mtf(const JsonSource& source, const std::string& pointer, std::vector<Problem>& problems) {
  constexpr double kCoarsest = 1e-6, kFinest = 1e6;
  ObjectReader reader(source, pointer, problems);
  reader.required_number("lp_per_mm", kCoarsest, kFinest);
  const auto limits = [](ObjectReader& of) {
    for (const char* direction : {"tangential", "sagittal"}) of.number(direction, 0, 0, 1);
    return of.has("tangential") || of.has("sagittal");
  };
  bool any = limits(reader);
  if (const Json* fields = reader.get("fields")) {
    if (!fields->is_array() || fields->empty()) {
      reader.complain("fields", "expected a list of fields, each a name or {\"name\": ..., \"tangential\": ...}");
    } else {
      std::map<std::string, std::string> places;  // pointers by name
      for (std::size_t i = 0; i < fields->size(); ++i) {
        const Json& value = (*fields)[i];
        const std::string place = reader.pointer_to("fields") + "/" + std::to_string(i);
        std::string name = value.is_string() ? value.get<std::string>() : "";
        if (!value.is_string()) {
          ObjectReader field(source, place, problems);
          name = field.required_string("name");
          any = limits(field) || any;
          field.reject_unknown();
        }
        const auto [first, is_new] = places.emplace(name, place);
        if (is_new || name.empty()) continue;
        const Problem before = source.problem(first->second, "");
        problems.push_back(source.problem(place, "duplicate field '" + name + "', already listed at line " +
                                                     std::to_string(before.line) + ", column " +
                                                     std::to_string(before.column)));
      }
    }
  }
  if (!any) reader.complain("", "expected a limit: 'tangential' or 'sagittal', here or in 'fields'");
  reader.reject_unknown();
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
  ObjectReader reader(source, pointer, problems);
  reader.number("rmse", 0, 0, kInfinity);
  if (reader.get("mtf")) {
    ObjectReader mtf(source, reader.pointer_to("mtf"), problems);
    constexpr double kCoarsest = 1e-6, kFinest = 1e6;
    mtf.required_number("lp_per_mm", kCoarsest, kFinest);
    mtf.number("centre", 0, 0, 1);
    mtf.number("corner", 0, 0, 1);
    mtf.boolean("diffraction", false);
    mtf.reject_unknown();
  }
  if (reader.get("field_mtf")) check_field_mtf(source, reader.pointer_to("field_mtf"), problems);
  for (const Criterion one : kCriteria)
    if (one != Criterion::field_mtf) reader.number(std::string(entry_of(one).key), 0, 0, kInfinity);
  reader.reject_unknown();
}

}  // namespace relign
