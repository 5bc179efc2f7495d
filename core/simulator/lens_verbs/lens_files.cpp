#include "lens_verbs/lens_files.h"

#include "base/error.h"
#include "imaging/scene_file.h"

namespace relign::cli {

namespace fs = std::filesystem;

fs::path scene_file_of(Context& context, const std::string& scene_id) {
  const plugin_host::Choice choice = context.catalog().resolve_or_throw(plugin_host::Kind::scene, scene_id);
  const std::string document = choice.plugin->document;
  if (document.empty() || !choice.parameters.contains(document))
    throw Error(ErrorKind::bad_input, "scene '" + scene_id +
                                          "' has no lens file; choose a preset of lens_system or a scene "
                                          "file");
  return choice.parameters.at(document).get<std::string>();
}

fs::path lens_file_of_scene(Context& context, const std::string& scene_id) {
  const fs::path scene_file = scene_file_of(context, scene_id);
  imaging::read_scene_file(scene_file, {});  // reports every mistake of the file, although only the lens is needed
  return scene_file.parent_path() / JsonSource::from_file(scene_file).root().at("lens").get<std::string>();
}

optics::Prescription lens_of(Context& context, const std::string& scene_id) {
  return imaging::read_scene_file(scene_file_of(context, scene_id), {}).lens;
}

}  // namespace relign::cli
