#include "lens_verbs/lens_section.h"

#include <cmath>

#include "base/text.h"
#include "imaging/scene_file.h"
#include "optics/first_order.h"

namespace relign::cli {
namespace {

std::string subtitle_of(const LensSubject& subject, bool as_built) {
  const optics::FirstOrder data = optics::first_order(subject.lens);
  std::string text = "f = " + significant(data.focal_length, 4) + " mm, f/" + significant(data.f_number, 3) + ", " +
                     significant(subject.lens.wavelength_nm, 4) + " nm; ";
  if (subject.object_z_mm)
    text += "object " + significant(-*subject.object_z_mm, 4) + " mm before the first vertex";
  else
    text += "object far away";
  return text + (as_built ? "; elements as built" : "");
}

}  // namespace

LensSubject subject_of_scene(const std::filesystem::path& scene_file) {
  const imaging::SceneFile scene = imaging::read_scene_file(scene_file, {});
  LensSubject subject;
  subject.lens = scene.lens;
  subject.name = scene.name == scene.lens.name ? scene.name : scene.name + ", lens " + scene.lens.name;
  subject.object_z_mm = scene.emitter.z_mm + scene.pivot_behind_first_vertex_mm;
  subject.sensor_high_mm = scene.sensor.top_mm;
  subject.sensor_low_mm = scene.sensor.top_mm - scene.sensor.height * scene.sensor.pitch_mm;
  return subject;
}

std::vector<double> usual_fields(const optics::Prescription& lens) {
  constexpr double kNarrow_deg = 5;
  if (lens.half_field_deg <= 0) return {0};
  // Whole degrees; two significant digits for the narrow field of a telescope.
  const double field = lens.half_field_deg,
               per_degree = field < kNarrow_deg ? std::pow(10, 1 - std::floor(std::log10(field))) : 1;
  return {0, std::round(0.7 * field * per_degree) / per_degree, std::floor(field * per_degree) / per_degree};
}

drawing::LensPicture picture_of(const LensSubject& subject, const optics::Assembly& assembly, bool as_built) {
  drawing::LensPicture picture;
  picture.assembly = &assembly;
  picture.title = subject.name;
  picture.subtitle = subtitle_of(subject, as_built);
  picture.sensor_low_mm = subject.sensor_low_mm;
  picture.sensor_high_mm = subject.sensor_high_mm;
  return picture;
}

drawing::DrawnFan fan_of(const LensSubject& subject, const optics::Assembly& assembly, double field_deg,
                         std::size_t series, int rays) {
  return {shortest(field_deg) + " deg", series, optics::ray_fan(assembly, field_deg, subject.object_z_mm, rays)};
}

}  // namespace relign::cli
