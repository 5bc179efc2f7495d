// Scene files, whole with a lens beside them.
#include "base/files.h"
#include "imaging/scene_file.h"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool prepared = [] {
    fuzz::write_scratch(fuzz::scratch_folder() / "lens.json",
                        read_file(RELIGN_SOURCE_DIR "/plugins/scenes/lens_system/relign_l2/lens.json"));
    return true;
  }();
  fuzz::demand(prepared, "a lens");
  const std::filesystem::path file = fuzz::scratch_folder() / "scene.json";
  fuzz::write_scratch(file, fuzz::text_of(data, size));
  fuzz::accepted([&] {
    imaging::SceneChoices choices;
    choices.rotation_z = size % 2 == 0;
    const imaging::SceneFile scene = imaging::read_scene_file(file, choices);
    fuzz::demand(scene.sensor.pixels() > 0 && scene.sensor.pixels() <= 200'000'000, "a sensor that can be");
    scene.lens_to_world(std::vector<double>(scene.axes(), 0.5));
  });
  return 0;
}
