#include "lens_verbs/camera_line.h"

#include "base/error.h"
#include "base/json_source.h"
#include "base/shared_keys.h"
#include "base/text.h"
#include "lens_files/scene_layout.h"
#include "records/specification.h"
#include "runner/spec_check.h"
#include "suites/suite.h"
#include "trials/judge.h"

namespace relign::cli {
namespace fs = std::filesystem;

LoadedScene load_draft(Context& context, const fs::path& draft) {
  return load_scene(context.catalog().resolve_or_throw(plugin_host::Kind::scene, (draft / "scene.json").string()),
                    context.services(core_count()));
}

Json own_specification(const std::string& file) {
  const JsonSource source = JsonSource::from_file(file);
  if (!source.root().is_object() || source.root().empty())
    throw Error(ErrorKind::bad_input, file + ": expected an object with the limits of a \"spec\", as in a suite");
  std::vector<Problem> problems;
  check_specification(source, "", problems);
  throw_if_any(problems);
  return source.root();
}

Json movement_of(Context& context, const std::string& stage) {
  using plugin_host::Kind;
  const auto resolved = [&](const std::string& level) {
    return context.catalog().resolve_or_throw(Kind::noise_level, level);
  };
  const auto movement_in = [](const plugin_host::Choice& level) {
    const std::string& key = level.plugin->document;
    const Json file = key.empty() ? Json() : level.parameters.value(key, Json());
    const Json root = file.is_string() ? JsonSource::from_file(file.get<std::string>()).root() : Json();
    return root.is_object() ? root.value("movement", Json()) : Json();
  };
  if (fs::path(stage).has_parent_path() || fs::path(stage).extension() == ".json") {
    const plugin_host::Choice level = resolved(stage);
    Json movement = movement_in(level);
    if (!movement.is_object())
      throw Error(ErrorKind::bad_input, "--stage: " + stage + ": a tolerance file with 'movement' is needed");
    try {
      plugin_host::NoiseLevel(level, context.services(1));
    } catch (const Error& error) {
      throw Error(ErrorKind::bad_input, "--stage: " + std::string(error.what()));
    }
    return movement;
  }
  std::vector<std::string> all, matching;
  for (const auto& plugin : context.catalog().plugins())
    for (const plugin_host::Preset& preset : plugin->presets)
      if (plugin->kind == Kind::noise_level && !movement_in(resolved(preset.id)).is_null()) {
        all.push_back(preset.id);
        if (preset.id.find(stage) != std::string::npos) matching.push_back(preset.id);
      }
  if (matching.size() != 1)
    throw Error(ErrorKind::bad_input,
                "--stage: " + std::string(matching.empty() ? "unknown" : "ambiguous") + " stage '" + stage +
                    "'; known: " + join(all, ", ") +
                    " (a part of the name suffices), or the path of a tolerance file with 'movement'");
  return movement_in(resolved(matching.front()));
}

std::string complete_camera(const LoadedScene& scene, lens_files::Layout& layout) {
  lens_files::set_electronics(layout, scene.facts.image_white);
  if (scene.facts.fields.empty())
    throw Error(
        ErrorKind::bad_input,
        "--camera: this target has no fields, on which MTF could be specified; expected camera_chart or "
        "slanted_edges with squares of at least 40 pixels on the sensor: use such a target or more pixels, none "
        "beyond the image of the lens");
  if (layout.scene.contains("spec")) return "";
  trials::Criteria criteria;
  criteria.lp_per_mm = lens_files::camera_lp_per_mm(layout);
  criteria.judged[Criterion::field_mtf] = true;
  for (std::size_t field = 0; field < scene.facts.fields.size(); ++field)
    criteria.field_mtf.push_back({static_cast<std::uint32_t>(field), 1, 1});
  plugin_host::MountedAssembly design_lens = scene.scene->mount("{}");
  const trials::FieldValues design = trials::design_fields(design_lens, scene.facts, criteria);
  trials::Judge judge(design_lens, scene.facts, criteria, design, 1);
  return lens_files::set_camera_specification(layout, 1 - judge.optimum(scene.facts.nominal_pose)->deficit);
}

SpecOutlook outlook_of(Context& context, const LoadedScene& scene, const fs::path& draft, unsigned lenses,
                       lens_files::Layout& layout) {
  suites::Suite judged;  // by the specification that the scene has, or will have
  if (scene.facts.spec.is_null()) judged.spec = layout.scene["spec"];
  const records::Specification spec = records::specification_of(judged.spec, scene.facts.spec, scene.facts.score);
  runner::check_mtf(judged, scene.facts.name, *scene.scene, scene.facts);
  runner::check_criteria(judged, scene.facts.name, *scene.scene, scene.facts);
  for (const std::string& warning : runner::mtf_warnings(spec, scene.facts)) print_warning(warning);
  SpecOutlook outlook = spec_outlook(
      context, scene,
      context.catalog().resolve_or_throw(plugin_host::Kind::noise_level, (draft / "tolerances.json").string()), spec,
      lenses);
  if (!outlook.lenses.empty())
    layout.lines.push_back(
        {"can meet the spec", outlook.lenses,
         outlook.warning.empty() ? "drawn by tolerances.json, at their best poses; 95 % interval" : outlook.warning});
  else if (!trials::limits_reachable(spec))
    layout.lines.push_back({"can meet the spec", "not judged", "it limits neither RMSE nor MTF"});
  return outlook;
}

}  // namespace relign::cli
