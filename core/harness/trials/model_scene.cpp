#include "trials/model_scene.h"

#include <algorithm>
#include <utility>

namespace relign::trials {
namespace {

bool same_axis(const Axis& a, const Axis& b) {
  return a.name == b.name && a.unit == b.unit && a.lower == b.lower && a.upper == b.upper;
}

// The first property in which the two differ; empty if none.
std::string difference(const SceneFacts& a, const SceneFacts& b) {
  if (!std::equal(a.axes.begin(), a.axes.end(), b.axes.begin(), b.axes.end(), same_axis)) return "axes";
  if (a.nominal_pose != b.nominal_pose) return "nominal_pose";
  if (a.image_width != b.image_width || a.image_height != b.image_height) return "image";
  return a.elements == b.elements ? "" : "elements";
}

}  // namespace

plugin_host::Choice model_choice(const plugin_host::Choice& scene) {
  Json changes = Json::object();
  for (const auto& [name, value] : scene.plugin->model_parameters.items()) {
    const Json& own = scene.parameters.at(name);
    const bool maps = value.is_object() && scene.plugin->parameter(name)->type == plugin_host::ParameterType::text;
    const Json wanted = maps ? value.value(own.get<std::string>(), own) : value;
    if (wanted != own) changes[name] = wanted;
  }
  return changes.empty() ? scene : with_changes(scene, changes);
}

ModelScene::ModelScene(plugin_host::Scene& own, const plugin_host::Choice& choice, plugin_host::HostServices services)
    : own_(own), choice_(model_choice(choice)), services_(std::move(services)) {
  if (choice_.parameters == choice.parameters) choice_.plugin.reset();  // the trial's own scene is its model
}

plugin_host::Scene& ModelScene::get(const SceneFacts& facts) {
  if (!choice_.plugin) return own_;
  if (other_) return *other_;
  auto& opened = other_.emplace(choice_, services_);
  const std::string differs = difference(facts, read_scene_facts(opened.describe(), choice_.id));
  if (differs.empty()) return opened;
  other_.reset();
  throw Error(ErrorKind::plugin_failed, "scene '" + choice_.id + "' with \"model_parameters\" has another '" + differs +
                                            "' in its description; must be equal to that of the trial's scene");
}

}  // namespace relign::trials
