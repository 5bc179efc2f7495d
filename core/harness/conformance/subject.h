// The plugin under check, with all its configurations.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "plugin_host/catalog.h"
#include "plugin_host/objects.h"

namespace relign::conformance {

class TrialScene;

struct Subject {
  std::shared_ptr<const plugin_host::Manifest> manifest;
  // The defaults, if they are complete, then every preset. Scenes with a parameter "pixels" get a
  // small image, so that a check takes seconds.
  std::vector<plugin_host::Choice> choices;
  std::string incomplete;             // why the defaults are incomplete; empty if they are complete
  std::shared_ptr<TrialScene> scene;  // on which an algorithm is checked; null: on synthetic merits and images

  plugin_host::Kind kind() const { return manifest->kind; }
  // The choice that most checks use. Only for subjects with choices.
  const plugin_host::Choice& choice() const { return choices.front(); }
};

// Throws Error(plugin_rejected) when the plugin does not exist or its manifest has mistakes.
Subject open_subject(const std::filesystem::path& plugin);

// Services for objects under check: the program's cache and a few threads, no log.
plugin_host::HostServices check_services(unsigned threads = 1);

}  // namespace relign::conformance
