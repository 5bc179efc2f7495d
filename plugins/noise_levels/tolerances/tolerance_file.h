// The tolerance file: limits in micrometres and arcminutes, and the data of a stage.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/json_source.h"

namespace tolerances {

// Distribution of a value within plus and minus its limit. normal: a normal distribution truncated at the limit, which
// is `sigmas` standard deviations.
enum class Law { normal, uniform };

// The point an element tilts about.
enum class Pivot { own_front, own_centre, own_back, scene };

struct ElementLimits {
  std::vector<double> shift_um;     // x, y, z
  std::vector<double> tilt_arcmin;  // about x and y
  Pivot pivot = Pivot::own_front;
};

// Limits of a displacement of the whole lens.
struct PoseLimits {
  std::string key;                  // in the file
  std::vector<double> shift_um;     // one per axis of the scene in mm, in the scene's order
  std::vector<double> tilt_arcmin;  // one per axis in degrees
  Law law = Law::normal;
};

// A value for every axis of the scene.
struct AxisValues {
  std::string key;                         // pointer to the value for axes in mm: "/movement/backlash_um"
  std::vector<double> shift_um = {0};      // one per axis in mm, in the scene's order
  std::vector<double> tilt_arcmin = {0};   // one per axis in degrees
  bool one_shift = true, one_tilt = true;  // a single number, for all axes of the kind
};

// Errors of the stage.
struct Movement {
  double cross_talk = 0;                           // limit
  AxisValues backlash, repeatability, resolution;  // the same for every draw
  AxisValues drift;                                // limits
  double drift_seconds = 0;                        // time constant; 0: no drift
  std::vector<double> pivot_um = {0, 0, 0};        // limits of the offset of the real centre of rotation along x, y, z
};

// Modules whose glue cures alike.
struct Batch {
  unsigned size = 1;      // modules
  PoseLimits cure_shift;  // of the mean of a batch
  AxisValues inspection;  // standard deviation of a measured cure shift
};

struct Tolerances {
  Law law = Law::normal;
  double sigmas = 3;
  std::optional<ElementLimits> every;          // "*": all other elements
  std::map<std::string, ElementLimits> named;  // by element
  PoseLimits start;
  Movement movement;
  std::optional<PoseLimits> cure_shift;  // shift while the adhesive cures; empty if all limits are 0
  std::optional<Batch> batch;            // then cure_shift is that of a module about the mean of its batch
};

// Throws Error(bad_input) that lists all errors with their positions.
Tolerances read_tolerances(const relign::JsonSource& source);

}  // namespace tolerances
