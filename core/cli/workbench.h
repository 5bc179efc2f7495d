// One scene and one of its lenses, in this process: what try, render and validate work on.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/machine.h"
#include "cli/app.h"
#include "plugin_host/objects.h"
#include "trials/instance.h"
#include "trials/scene_facts.h"

namespace relign::cli {

// What an argument names: an id, a preset, a path, or an object with "use" and "parameters" as in a suite (its "name"
// is not needed here). `parameters`: of its own option; null without. Throws Error(bad_input) that names `option`.
plugin_host::Choice named_choice(plugin_host::Catalog& catalog, plugin_host::Kind kind, const std::string& text,
                                 const std::string& option, const Json& parameters = {});

struct LoadedScene {
  plugin_host::Choice choice;
  std::unique_ptr<plugin_host::Scene> scene;
  trials::SceneFacts facts;
};

// Failures while a scene is made or described come from what the user gave it (files, parameters):
// they become Error(bad_input) that names the scene.
LoadedScene load_scene(plugin_host::Choice choice, const plugin_host::HostServices& services);

// Draws benchmark instance `number`, as a suite with this seed would.
trials::Instance draw_instance(const plugin_host::Choice& level, const LoadedScene& scene,
                             const plugin_host::HostServices& services, std::uint64_t suite_seed, std::uint64_t number);

// "0.5,0.5,0.4" as numbers; throws Error(bad_input) that names the option.
std::vector<double> parse_numbers(const std::string& text, const std::string& option);

}  // namespace relign::cli
