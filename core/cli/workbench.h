// Loads a scene and draws an instance in this process, for try, render, validate and others.
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

// Resolves an id, a preset, a path, or an object with "use" and "parameters" as in a suite ("name" is ignored).
// `parameters` are those of --parameters, null if absent. Throws Error(bad_input) that names `option`.
plugin_host::Choice named_choice(plugin_host::Catalog& catalog, plugin_host::Kind kind, const std::string& text,
                                 const std::string& option, const Json& parameters = {});

// For refusals.
inline constexpr const char* kScenesWithDerivatives =
    "those of lens_system have, with transport 'refract' or 'fresnel' and without diffraction";

struct LoadedScene {
  plugin_host::Choice choice;
  std::unique_ptr<plugin_host::Scene> scene;
  trials::SceneFacts facts;
  std::size_t memory_bytes = 0;  // most that this process had while it was created; 0: unknown
};

// Throws Error(bad_input) that names the scene if it cannot be created or described, because the cause is the user's
// files or parameters.
LoadedScene load_scene(plugin_host::Choice choice, const plugin_host::HostServices& services);

// Draws benchmark instance `number`, as a suite with this seed would.
trials::Instance draw_instance(const plugin_host::Choice& level, const LoadedScene& scene,
                               const plugin_host::HostServices& services, std::uint64_t suite_seed,
                               std::uint64_t number);

// Parses "0.5,0.5,0.4". Throws Error(bad_input) that names the option.
std::vector<double> parse_numbers(const std::string& text, const std::string& option);

}  // namespace relign::cli
