// The cross-section of a lens for `lens draw` and reports; of a scene, with sensor and object distance.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "lens_drawing/lens_drawing.h"
#include "optics/assembly.h"

namespace relign::cli {

inline constexpr int kUsualRays = 7;

// A lens and, if it comes from a scene, its object and sensor in lens coordinates.
struct LensSubject {
  optics::Prescription lens;
  std::string name;
  std::optional<double> object_z_mm;
  std::optional<double> sensor_low_mm, sensor_high_mm;
};

LensSubject subject_of_scene(const std::filesystem::path& scene_file);  // throws Error as read_scene_file does

// 0, 0.7 of the half field and the half field, degrees, rounded.
std::vector<double> usual_fields(const optics::Prescription& lens);

// The drawing without rays. `subject` and `assembly` must outlive it.
drawing::LensPicture picture_of(const LensSubject& subject, const optics::Assembly& assembly, bool as_built);
drawing::DrawnFan fan_of(const LensSubject& subject, const optics::Assembly& assembly, double field_deg,
                         std::size_t series, int rays);

}  // namespace relign::cli
