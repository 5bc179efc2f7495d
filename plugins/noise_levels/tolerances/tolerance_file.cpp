#include "tolerance_file.h"

#include <algorithm>
#include <array>

#include "base/text.h"

namespace tolerances {
namespace {

using relign::Json;
using relign::ObjectReader;
using relign::Problem;

constexpr double kLargestShiftUm = 1e6;
constexpr double kLargestTiltArcmin = 45 * 60;
constexpr std::size_t kMaxAxes = 64;
constexpr std::int64_t kMaxBatch = 1000;

template <class Value>
struct Named {
  const char* name;
  Value value;
};
constexpr std::array<Named<Law>, 2> kLaws = {{{"normal", Law::normal}, {"uniform", Law::uniform}}};
constexpr std::array<Named<Pivot>, 4> kPivots = {{{"own_front", Pivot::own_front},
                                                  {"own_centre", Pivot::own_centre},
                                                  {"own_back", Pivot::own_back},
                                                  {"scene", Pivot::scene}}};

template <class Table, class Value>
Value one_of(ObjectReader& reader, const std::string& key, const Table& table, Value fallback) {
  if (!reader.has(key)) {
    reader.get(key);  // marks the key as known
    return fallback;
  }
  std::vector<std::string> allowed;
  const std::string found = reader.string(key, "");
  for (const auto& entry : table) {
    if (found == entry.name) return entry.value;
    allowed.emplace_back(entry.name);
  }
  reader.complain(key, "found '" + found + "', allowed: " + relign::join(allowed, ", "));
  return fallback;
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// Reads a list of `count` limits (0: any number); zeros if the key is missing.
std::vector<double> limits(ObjectReader& reader, const std::string& key, std::size_t count, double largest) {
  const Json* list = reader.get(key);
  if (!list) return std::vector<double>(count, 0.0);
  if (count == 0 && !list->is_array()) {
    reader.complain(key, std::string("expected a list of limits, one per axis of the scene, such as ") +
                             (ends_with(key, "_um") ? "[100, 100, 60] for x, y and z" : "[60, 60] for Rx and Ry") +
                             ", found " + list->dump());
    return {};
  }
  if (count == 0) count = std::min(list->size(), kMaxAxes);
  const std::vector<double> values = reader.numbers(key, count, {});
  for (const double value : values)
    if (!(value >= 0 && value <= largest))
      reader.complain(key, "found '" + relign::shortest(value) + "', allowed: limits from 0 to " +
                               relign::shortest(largest) + " (values are drawn within plus and minus the limit)");
  return values;
}

ElementLimits read_element(const relign::JsonSource& source, const std::string& pointer,
                           std::vector<Problem>& problems) {
  ObjectReader reader(source, pointer, problems);
  ElementLimits element;
  element.shift_um = limits(reader, "shift_um", 3, kLargestShiftUm);
  element.tilt_arcmin = limits(reader, "tilt_arcmin", 2, kLargestTiltArcmin);
  element.pivot = one_of(reader, "pivot", kPivots, Pivot::own_front);
  reader.reject_unknown();
  return element;
}

// `key`: pointer without the first slash.
PoseLimits read_pose(const relign::JsonSource& source, const std::string& key, Law law,
                     std::vector<Problem>& problems) {
  ObjectReader reader(source, "/" + key, problems);
  PoseLimits pose;
  pose.key = key;
  pose.shift_um = limits(reader, "shift_um", 0, kLargestShiftUm);
  pose.tilt_arcmin = limits(reader, "tilt_arcmin", 0, kLargestTiltArcmin);
  pose.law = one_of(reader, "law", kLaws, law);
  reader.reject_unknown();
  return pose;
}

bool all_zero(const std::vector<double>& shift_um, const std::vector<double>& tilt_arcmin) {
  const auto zero = [](double limit) { return limit == 0; };
  return std::all_of(shift_um.begin(), shift_um.end(), zero) &&
         std::all_of(tilt_arcmin.begin(), tilt_arcmin.end(), zero);
}

// A number for all axes of a kind, or a list.
std::vector<double> read_axis_values(ObjectReader& reader, const std::string& key, double largest, bool& one) {
  const Json* given = reader.get(key);
  one = !given || given->is_number();
  return one ? std::vector<double>{reader.number(key, 0, 0, largest)} : limits(reader, key, 0, largest);
}

AxisValues read_axis_values(ObjectReader& reader, const std::string& name) {
  AxisValues values;
  values.key = reader.pointer_to(name + "_um");
  values.shift_um = read_axis_values(reader, name + "_um", kLargestShiftUm, values.one_shift);
  values.tilt_arcmin = read_axis_values(reader, name + "_arcmin", kLargestTiltArcmin, values.one_tilt);
  return values;
}

Movement read_movement(const relign::JsonSource& source, std::vector<Problem>& problems) {
  ObjectReader reader(source, "/movement", problems);
  Movement movement;
  movement.cross_talk = reader.number("cross_talk", 0, 0, 0.5);
  movement.backlash = read_axis_values(reader, "backlash");
  movement.repeatability = read_axis_values(reader, "repeatability");
  movement.resolution = read_axis_values(reader, "resolution");
  movement.drift = read_axis_values(reader, "drift");
  const bool drifts = !all_zero(movement.drift.shift_um, movement.drift.tilt_arcmin);
  if (drifts && !reader.has("drift_seconds"))
    reader.complain_missing("drift_seconds", "the time constant of 'drift_um' and 'drift_arcmin'");
  const double seconds = reader.number("drift_seconds", 1, 1e-3, 1e9);
  movement.drift_seconds = drifts ? seconds : 0;
  movement.pivot_um = limits(reader, "pivot_um", 3, kLargestShiftUm);
  reader.reject_unknown();
  return movement;
}

Batch read_batch(const relign::JsonSource& source, Law law, std::vector<Problem>& problems) {
  ObjectReader reader(source, "/batch", problems);
  Batch batch;
  if (!reader.has("size")) reader.complain_missing("size", "modules per batch");
  batch.size = static_cast<unsigned>(reader.integer("size", 1, 1, kMaxBatch));
  if (reader.get("cure_shift"))
    batch.cure_shift = read_pose(source, "batch/cure_shift", law, problems);
  else
    reader.complain_missing("cure_shift", "limits of the mean cure shift of a batch");
  batch.inspection = read_axis_values(reader, "inspection");
  reader.reject_unknown();
  return batch;
}

}  // namespace

Tolerances read_tolerances(const relign::JsonSource& source) {
  std::vector<Problem> problems;
  Tolerances read;
  ObjectReader top(source, "", problems);
  top.string("use", "");
  read.sigmas = top.number("limits_are_sigmas", 3, 0.1, 100);
  read.law = one_of(top, "law", kLaws, Law::normal);

  const Json* elements = top.get("elements");
  if (!elements) top.complain_missing("elements", "limits by element; \"*\" for all other elements");
  if (elements) {
    ObjectReader all(source, "/elements", problems);  // reports an error if it is not an object
    if (elements->is_object())
      for (const auto& item : elements->items()) {
        const ElementLimits element = read_element(source, all.pointer_to(item.key()), problems);
        if (item.key() == "*")
          read.every = element;
        else
          read.named[item.key()] = element;
      }
  }

  if (top.get("start"))
    read.start = read_pose(source, "start", read.law, problems);
  else
    top.complain_missing("start", "limits of the start around the nominal pose");
  if (top.get("cure_shift")) read.cure_shift = read_pose(source, "cure_shift", read.law, problems);
  if (read.cure_shift && all_zero(read.cure_shift->shift_um, read.cure_shift->tilt_arcmin)) read.cure_shift.reset();
  if (top.get("batch")) read.batch = read_batch(source, read.law, problems);
  if (top.get("movement")) read.movement = read_movement(source, problems);
  top.reject_unknown();
  relign::throw_if_any(problems);
  return read;
}

}  // namespace tolerances
