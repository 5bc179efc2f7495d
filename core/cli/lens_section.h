// The section of a lens as `lens draw` and reports show it: with its surroundings when it comes from a scene.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drawing/lens_drawing.h"
#include "optics/assembly.h"

namespace relign::cli {

inline constexpr int kUsualRays = 7;

// What is drawn: a lens, and its surroundings in lens coordinates when it comes from a scene.
struct LensSubject {
  optics::Prescription lens;
  std::string name;
  std::optional<double> object_z_mm;
  std::optional<double> sensor_low_mm, sensor_high_mm;
};

LensSubject subject_of_scene(const std::filesystem::path& scene_file);  // throws Error as read_scene_file does

// 0, 0.7 of the half field and the half field, degrees.
std::vector<double> usual_fields(const optics::Prescription& lens);

// Without rays. Both arguments must outlive it.
drawing::LensPicture picture_of(const LensSubject& subject, const optics::Assembly& assembly, bool as_built);
drawing::DrawnFan fan_of(const LensSubject& subject, const optics::Assembly& assembly, double field_deg,
                         std::size_t series, int rays);

}  // namespace relign::cli
