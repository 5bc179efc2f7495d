// Lens files of our own, element offsets, and rays to trace.
#include <cmath>

#include "optics/assembly.h"
#include "optics/first_order.h"
#include "optics/prescription.h"
#include "optics/ray_file.h"
#include "optics/trace.h"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  fuzz::accepted([&] {
    const JsonSource source = JsonSource::from_text(text, "lens.json");
    if (source.root().contains("offsets")) {
      optics::Prescription lens;
      for (const char* name : {"L1", "L2"}) lens.elements.push_back({name, {optics::Face()}});
      optics::Assembly(lens, optics::read_offsets(source, "/offsets", lens));
      return;
    }
    if (source.root().contains("rays")) {
      static const optics::Prescription lens = optics::read_prescription(
          JsonSource::from_file(RELIGN_SOURCE_DIR "/plugins/scenes/lens_system/relign_l2/lens.json"));
      for (const optics::RayRequest& request : optics::read_rays(source, lens)) {
        const optics::TracedRay traced =
            optics::trace(optics::Assembly(lens, request.elements), request.ray, optics::Apertures::mesh);
        fuzz::demand(!optics::traced_to_json(request, traced).empty(), "a trace that can be written");
      }
      return;
    }
    const optics::Prescription lens = optics::read_prescription(source);
    for (const optics::Element& element : lens.elements)
      for (const optics::Face& face : element.faces)
        fuzz::demand(std::isfinite(face.z_mm) && std::isfinite(face.curvature) && std::fabs(face.index_after) >= 1,
                     "faces that light can pass");
    optics::first_order(lens);
  });
  return 0;
}
