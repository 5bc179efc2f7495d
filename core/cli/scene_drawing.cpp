#include "cli/scene_drawing.h"

#include "base/error.h"
#include "cli/lens_section.h"

namespace relign::cli {

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

}  // namespace relign::cli
