// Scene files, whole with a lens beside them: the text behind a line "---", or a lens of ours.
#include "base/files.h"
#include "imaging/scene_file.h"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string own_lens = read_file(RELIGN_SOURCE_DIR "/plugins/scenes/lens_system/relign_l2/lens.json");
  const std::string text = fuzz::text_of(data, size), border = "\n---\n";
  const std::size_t end = text.find(border);
  fuzz::write_scratch(fuzz::scratch_folder() / "lens.json",
                      end == std::string::npos ? own_lens : text.substr(end + border.size()));
  const std::filesystem::path file = fuzz::scratch_folder() / "scene.json";
  fuzz::write_scratch(file, text.substr(0, end));
  fuzz::accepted([&] {
    imaging::SceneChoices choices;
    choices.rotation_z = size % 2 == 0;
    const imaging::SceneFile scene = imaging::read_scene_file(file, choices);
    fuzz::demand(scene.sensor.pixels() > 0 && scene.sensor.pixels() <= 200'000'000, "a sensor that can be");
    fuzz::demand(scene.pupil->grid().places() <= optics::PlaceRange().most_places, "regions that fit into memory");
    fuzz::demand(scene.pupil->work().all() <= optics::PupilSearch::kMostWork, "a lens that can be traced in time");
    scene.lens_to_world(std::vector<double>(scene.axes(), 0.5));
  });
  return 0;
}
