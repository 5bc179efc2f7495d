#include "trials/field_merit.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <relign/portable_math.hpp>

#include "base/error.h"
#include "base/text.h"

namespace relign::trials {
namespace {

using images::Direction;

constexpr double kQuarterOfNyquist = 0.125;  // cycles per pixel
constexpr Direction kDirections[] = {Direction::tangential, Direction::sagittal};

double limit_of(const MtfLimits& limits, const images::EdgeField& field) {
  return field.name == images::kCentreField ? limits.centre : limits.corner;
}

double frequency_of(const MtfLimits& limits, const SceneFacts& scene) {
  return limits.limits_anything() ? limits.lp_per_mm * scene.pitch_um / 1000 : kQuarterOfNyquist;
}

}  // namespace

std::string field_merit_mistake(Merit merit, const MtfLimits& limits, const SceneFacts& scene) {
  if (!needs_fields(merit)) return "";
  const std::string needs = std::string("merit '") + merit_name(merit) + "' ";
  if (scene.fields.empty())
    return needs + "needs slanted edges, but the scene '" + scene.name +
           "' describes no 'fields'; use a scene with the target camera_chart or slanted_edges, such as camera_2mp, or "
           "merit 'rmse'";
  if (merit != Merit::mtf || !limits.limits_anything()) return "";
  if (!(scene.pitch_um > 0))
    return needs + "needs the size of a pixel for limits in line pairs per mm, but the scene '" + scene.name +
           "' describes no 'pitch_um'";
  if (frequency_of(limits, scene) > 0.5)
    return needs + "cannot be measured at " + shortest(limits.lp_per_mm) + " lp/mm on pixels of " +
           shortest(scene.pitch_um) + " um; the specification must be at most " + shortest(500 / scene.pitch_um) +
           " lp/mm for the scene '" + scene.name + "'";
  if (std::none_of(scene.fields.begin(), scene.fields.end(),
                   [&](const images::EdgeField& field) { return !std::isnan(limit_of(limits, field)); }))
    return needs + "has no limit for any field of the scene '" + scene.name + "'; give 'corner' in the specification";
  return "";
}

FieldMerit::FieldMerit(Merit merit, const MtfLimits& limits, const SceneFacts& scene, const images::View& reference)
    : merit_(merit), limits_(limits), scene_(scene), cycles_per_pixel_(frequency_of(limits, scene)) {
  if (const std::string mistake = field_merit_mistake(merit, limits, scene); !mistake.empty())
    throw Error(ErrorKind::bad_input, mistake);
  pixel_mtf_ = portable_sine_cosine(180 * cycles_per_pixel_).sine / (std::numbers::pi * cycles_per_pixel_);
  reference_energy_ = images::FieldEdges(reference, scene.fields).edge_energy();
  if (!(reference_energy_ > 0))
    throw Error(ErrorKind::plugin_failed,
                "scene '" + scene.name + "': the reference image has no edges in the scene's 'fields'");
}

double FieldMerit::of(const images::View& capture, const images::EdgeFields& fields) const {
  const images::FieldEdges edges(capture, fields);
  if (merit_ == Merit::mtf) return mtf_of(edges);
  return reference_energy_ / (reference_energy_ + edges.edge_energy());
}

double FieldMerit::mtf_of(const images::FieldEdges& edges) const {
  double worst = 0;
  for (std::size_t field = 0; field < scene_.fields.size(); ++field) {
    const double limit = limits_.limits_anything() ? limit_of(limits_, scene_.fields[field]) : 1;
    if (std::isnan(limit)) continue;
    for (const Direction direction : kDirections) {
      if (!scene_.fields[field].region(direction)) continue;
      const double mtf = edges.mtf(field, direction, cycles_per_pixel_) / pixel_mtf_;
      worst = std::max(worst, std::isnan(mtf) ? limit : limit - mtf);
    }
  }
  return worst;
}

}  // namespace relign::trials
