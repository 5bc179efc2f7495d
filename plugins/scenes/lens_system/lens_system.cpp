// Scene plugin: a lens of spherical elements, traced face by face.
#include "lens_scene/lens_scene.h"

namespace {

class LensSystem final : public relign::lens_scene::LensScene {
 public:
  explicit LensSystem(const relign::Parameters& given)
      : LensScene(given, {relign::lens_scene::read_scene(given), nullptr, ""}, "lens_system.so") {}
};

}  // namespace

RELIGN_PLUGIN(LensSystem)
