// The scene behind the service "model": the trial's own, or a second one opened with the manifest's
// "model_parameters", if they change any of the trial's values.
#pragma once

#include <optional>

#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::trials {

// The design model's parameters; `scene` itself if the manifest changes none of its values. Throws Error(bad_input), as
// with_changes does.
plugin_host::Choice model_choice(const plugin_host::Choice& scene);

class ModelScene {
 public:
  // `own` must outlive this object.
  ModelScene(plugin_host::Scene& own, const plugin_host::Choice& choice, plugin_host::HostServices services);

  // Opens the scene at the first call. Throws Error(plugin_failed) unless it has the axes, the nominal pose, the image
  // size and the elements of the trial's scene, `facts`.
  plugin_host::Scene& get(const SceneFacts& facts);

 private:
  plugin_host::Scene& own_;
  plugin_host::Choice choice_;
  plugin_host::HostServices services_;
  std::optional<plugin_host::Scene> other_;
};

}  // namespace relign::trials
