#include "lens_verbs/extensions.h"

#include "base/error.h"
#include "lens_verbs/lens_section.h"
#include "optics/ray_block.h"
#if RELIGN_HAS_GPU
#include "gpu/gpu.h"
#endif

namespace relign::cli {
namespace {

// The SVG of `lens draw --scene`.
std::string scene_lens_svg(const plugin_host::Choice& scene) {
  const std::string& document = scene.plugin->document;
  if (document.empty() || !scene.parameters.contains(document) || !scene.parameters[document].is_string()) return "";
  try {
    const LensSubject subject = subject_of_scene(scene.parameters[document].get<std::string>());
    const optics::Assembly assembly(subject.lens, {});
    drawing::LensPicture picture = picture_of(subject, assembly, false);
    for (const double field : usual_fields(subject.lens))
      picture.fans.push_back(fan_of(subject, assembly, field, picture.fans.size(), kUsualRays));
    return drawing::lens_svg(picture);
  } catch (const Error&) {  // the document of another plugin
    return "";
  }
}

Finding vector_instructions() {
  for (const char* set : {"avx512", "avx2"})
    if (optics::block_kernels(set)) return {"instructions", "ok", set};
#if defined(__aarch64__)
  return {"instructions", "ok", "neon"};
#else
  return {"instructions", "note",
          "no AVX2: the simulator is several times slower than documented; images are the same"};
#endif
}

#if RELIGN_HAS_GPU
Finding gpu_of_this_machine() {
  const gpu::Availability found = gpu::look_for_gpu();
  if (found.usable) return {"gpu", "ok", found.sentence};
  return {"gpu", "note", found.sentence + ": the GPU simulator cannot run"};
}
#endif

}  // namespace

void extend_harness(Extensions& extensions) {
  extensions.draw_lens = scene_lens_svg;
  extensions.findings.push_back(vector_instructions);
#if RELIGN_HAS_GPU
  extensions.findings.push_back(gpu_of_this_machine);
#endif
}

}  // namespace relign::cli
