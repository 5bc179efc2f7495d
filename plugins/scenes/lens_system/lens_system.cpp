// lens_system: a lens of spherical or aspheric elements, traced sequentially. See README.md.
#include "lens_scene/lens_scene.h"

namespace {

namespace lens_scene = relign::lens_scene;

lens_scene::Parts parts(const relign::Parameters& given) {
  lens_scene::Parts parts = lens_scene::read_parts(given);
  parts.settings.sensor_albedo = given.number("sensor_albedo");
  parts.settings.scored_tiles = static_cast<int>(given.integer("scored_tiles"));
  if (const std::string file = given.text("imaging_errors"); !file.empty())
    parts.errors = relign::imaging::read_imaging_errors(file);
  if (const long pixels = given.integer("windows"); pixels > 0)
    lens_scene::read_windows_only(parts, static_cast<int>(pixels));
  return parts;
}

class LensSystem final : public lens_scene::LensScene {
 public:
  explicit LensSystem(const relign::Parameters& given) : LensScene(given, parts(given), "lens_system.so") {}
};

}  // namespace

RELIGN_PLUGIN(LensSystem)
