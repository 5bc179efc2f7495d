#include "tolerance_file.h"

#include <algorithm>

#include "base/json_members.h"
#include "base/schema.h"

extern "C" {
extern const unsigned char relign_schema_tolerances[];
extern const unsigned long relign_schema_tolerances_size;
}

namespace tolerances {
namespace {

using relign::Json;
using relign::member;

Law law_of(const Json& object, Law otherwise) {
  const Json& law = member(object, "law");
  return law.is_null() ? otherwise : law == "uniform" ? Law::uniform : Law::normal;
}

Pivot pivot_of(const std::string& name) {
  return name == "own_centre" ? Pivot::own_centre
         : name == "own_back" ? Pivot::own_back
         : name == "scene"    ? Pivot::scene
                              : Pivot::own_front;
}

// `count` zeros if the key is missing.
std::vector<double> limits(const Json& object, const char* key, std::size_t count) {
  const auto list = object.find(key);
  return list == object.end() ? std::vector<double>(count, 0.0) : list->get<std::vector<double>>();
}

ElementLimits element_of(const Json& object) {
  return {limits(object, "shift_um", 3), limits(object, "tilt_arcmin", 2), pivot_of(object["pivot"])};
}

// `key`: in the file, a pointer without the first slash.
PoseLimits pose_of(const Json& object, const std::string& key, Law law) {
  return {key, limits(object, "shift_um", 0), limits(object, "tilt_arcmin", 0), law_of(object, law)};
}

bool all_zero(const std::vector<double>& shift_um, const std::vector<double>& tilt_arcmin) {
  const auto zero = [](double limit) { return limit == 0; };
  return std::all_of(shift_um.begin(), shift_um.end(), zero) &&
         std::all_of(tilt_arcmin.begin(), tilt_arcmin.end(), zero);
}

// A number for all axes of a kind, or a list.
std::vector<double> values_of(const Json& object, const std::string& key, bool& one) {
  const Json& given = member(object, key.c_str());
  one = !given.is_array();
  return one ? std::vector<double>{given.is_null() ? 0.0 : given.get<double>()} : given.get<std::vector<double>>();
}

AxisValues axis_values(const Json& object, const std::string& pointer, const std::string& name) {
  AxisValues values;
  values.key = pointer + "/" + name + "_um";
  values.shift_um = values_of(object, name + "_um", values.one_shift);
  values.tilt_arcmin = values_of(object, name + "_arcmin", values.one_tilt);
  return values;
}

Movement movement_of(const Json& object) {
  const auto values = [&object](const char* name) { return axis_values(object, "/movement", name); };
  return {object["cross_talk"],         values("backlash"), values("repeatability"),
          values("resolution"),         values("drift"),    object.value("drift_seconds", 0.0),
          limits(object, "pivot_um", 3)};
}

}  // namespace

Tolerances read_tolerances(const relign::JsonSource& source) {
  static const relign::Schema schema(relign_schema_tolerances, relign_schema_tolerances_size);
  std::vector<relign::Problem> problems;
  const Json file = schema.checked(source, problems);
  Tolerances read;
  read.sigmas = file["limits_are_sigmas"];
  read.law = law_of(file, Law::normal);
  for (const auto& [name, element] : file["elements"].items()) {
    if (name == "*")
      read.every = element_of(element);
    else
      read.named[name] = element_of(element);
  }
  read.start = pose_of(file["start"], "start", read.law);
  if (file.contains("cure_shift")) read.cure_shift = pose_of(file["cure_shift"], "cure_shift", read.law);
  if (read.cure_shift && all_zero(read.cure_shift->shift_um, read.cure_shift->tilt_arcmin)) read.cure_shift.reset();
  if (const auto batch = file.find("batch"); batch != file.end())
    read.batch = Batch{(*batch)["size"], pose_of((*batch)["cure_shift"], "batch/cure_shift", read.law),
                       axis_values(*batch, "/batch", "inspection")};
  if (const auto movement = file.find("movement"); movement != file.end()) {
    read.movement = movement_of(*movement);
    const bool drifts = !all_zero(read.movement.drift.shift_um, read.movement.drift.tilt_arcmin);
    if (drifts && !movement->contains("drift_seconds"))
      problems.push_back(source.problem(
          "/movement", "missing key 'drift_seconds' (the time constant of 'drift_um' and 'drift_arcmin')"));
    if (!drifts) read.movement.drift_seconds = 0;
  }
  relign::throw_if_any(problems);
  return read;
}

}  // namespace tolerances
