// The file a user writes: limits as suppliers quote them, in micrometres and minutes of arc.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"

namespace tolerances {

// How a value lies within +- its limit. normal: the limit is `sigmas` standard deviations, nothing lies beyond it.
enum class Law { normal, uniform };

// The point an element tilts about.
enum class Pivot { own_front, own_centre, own_back, scene };

struct ElementLimits {
  std::vector<double> shift_um;     // x, y, z
  std::vector<double> tilt_arcmin;  // about x and y
  Pivot pivot = Pivot::own_front;
};

// Of the whole lens.
struct PoseLimits {
  std::string key;                  // in the file
  std::vector<double> shift_um;     // one for each axis of the scene in mm, in their order
  std::vector<double> tilt_arcmin;  // one for each axis in degrees
  Law law = Law::normal;
};

struct Tolerances {
  Law law = Law::normal;
  double sigmas = 3;
  std::optional<ElementLimits> every;          // "*": elements that are not named
  std::map<std::string, ElementLimits> named;  // by element
  PoseLimits start;
  double cross_talk = 0;
  std::optional<PoseLimits> cure_shift;  // while the glue cures; absent also when all limits are 0
};

// Throws Error(bad_input) that lists every mistake with its place.
Tolerances read_tolerances(const relign::JsonSource& source);

}  // namespace tolerances
