// What a scene judges a pose by: a number that is the better the lower it is, 0 for a perfect pose.
//
// Scenes that compare images are judged by the RMSE against the reference image. Others declare "score" in their
// description: {"name": "insertion loss", "unit": "dB", "scale": "linear", "resolution": 0.01, "reading": "loss"}. In a
// capture it is measured by a reading, else by the RMSE. "further": [{"name": "FWHM", "unit": "arcsec"}, ...] are
// numbers of the same kind that are recorded and may be limited, but rank nothing.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/criteria.h"
#include "base/described.h"
#include "base/displayed_rmse.h"
#include "base/json_source.h"

namespace relign {

// "RMSE", "insertion loss in dB"; "flux", of the unit 1
inline std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() || unit == "1" ? name : name + " in " + unit;
}

struct FurtherScore {
  std::string name, unit;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"name"}, s.name...);
    visit(Member{"unit", "", kMayLack}, s.unit...);
  }
  std::string label() const { return with_unit(name, unit); }
  bool operator==(const FurtherScore&) const = default;
};

struct SceneScore {
  std::string name = "RMSE";
  std::string unit;          // empty: none
  bool logarithmic = true;   // how charts scale it
  double resolution = 1e-4;  // smaller differences are within its error
  // Whether records keep its square, as the RMSE is kept as an MSE, which can be estimated without bias.
  bool squared = true;
  std::vector<FurtherScore> further;  // at most kMostFurtherScores

  // Of a recorded value, or of the difference of two: never negative, since an estimate near 0 may be. NaN stays NaN.
  double shown(double recorded) const { return squared || recorded <= 0 ? displayed_rmse(recorded) : recorded; }
  std::string label() const { return with_unit(name, unit); }
  const FurtherScore* further_of(Criterion criterion) const;  // null: another criterion, or not declared
  // " dB" behind a number
  std::string suffix() const { return unit.empty() || unit == "1" ? "" : " " + unit; }
  bool operator==(const SceneScore&) const = default;
};

// A reading of an instrument that a scene gives instead of an image.
struct Reading {
  std::string name, unit;
};

// What a capture has, as a row of values: an image, readings, or both, the readings behind the image.
struct Measurements {
  std::vector<Reading> readings;
  std::size_t pixels = 0;  // of the image; 0: none
};

// Of a description with "score"; `measure` gets the place of the value that measures it in a capture, and stays as it
// is without one.
SceneScore read_scene_score(const JsonSource& source, const Measurements& measured, std::optional<std::size_t>& measure,
                            std::vector<Problem>& problems);

// A score as a manifest keeps it, which leaves out the RMSE.
struct StatedScore {
  std::string name, unit, scale = "linear";
  double resolution = SceneScore().resolution;
  std::vector<FurtherScore> further;

  template <class Visit, class... S>
  static void members(Visit&& visit, S&... s) {
    visit(Member{"name"}, s.name...);
    visit(Member{"unit"}, s.unit...);
    visit(Member{.key = "scale", .one_of = "linear log"}, s.scale...);
    visit(Member{.key = "resolution", .flags = kAboveLeast, .least = 0}, s.resolution...);
    visit(Member{"further", "", kLeftOut}, s.further...);
  }
};

template <>
struct JsonForm<SceneScore> {
  static Json write(const SceneScore& score);
  static void read(const Member& member, const Json& json, SceneScore& score, JsonFlaws& flaws);
  static bool left_out(const SceneScore& score) { return score.squared; }
};

}  // namespace relign
