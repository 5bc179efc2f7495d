// Lens files of design programs: Zemax, CODE V and its listings, each into lens, scene and suite.
#include "lens_files/completion.h"
#include "lens_files/lens_writer.h"
#include "lens_files/read_design.h"
#include "lens_files/scene_layout.h"
#include "optics/glass.h"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes = fuzz::text_of(data, size);
  fuzz::accepted([&] {
    lens_files::LensDesign design = lens_files::read_design(bytes, "the file");
    lens_files::GlassSources sources;
    sources.is_known = [](const std::string& name) { return name.size() == 6 || name == "BK7"; };
    const lens_files::CompleteLens lens =
        lens_files::complete_lens(design, lens_files::draft_lens(design, sources, "made", 587.6));
    lens_files::LayoutChoices choices;
    choices.name = "made";
    const lens_files::Layout layout = lens_files::lay_out(design, lens, choices);
    lens_files::readme(design, lens, choices, layout);
    fuzz::demand(!parsed_json(lens_files::pretty(layout.scene)).is_discarded(), "a scene file that is JSON");
    optics::read_prescription(JsonSource::from_text(lens_files::pretty(lens.json), "lens.json"));
  });
  return 0;
}
