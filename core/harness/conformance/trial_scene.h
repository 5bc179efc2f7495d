// A scene on which methods are checked: what a fake trial shows is captured from one device.
#pragma once

#include <string>
#include <vector>

#include "conformance/fake_trial.h"
#include "plugin_host/catalog.h"
#include "plugin_host/objects.h"
#include "trials/instance.h"
#include "trials/scene_facts.h"

namespace relign::conformance {

class TrialScene {
 public:
  // A scene with uncertain quantities gives the first device that the noise level `declared` draws, another one the
  // device without offsets. Throws Error(bad_input) for a station.
  explicit TrialScene(const plugin_host::Choice& choice);

  const std::string& name() const { return facts_.name; }
  std::uint32_t axes() const { return static_cast<std::uint32_t>(facts_.axes.size()); }
  // Axes, start, box, merit, captures and reference of a trial, in the coordinates of the stage or from the start. The
  // scene must outlive the trials.
  void fill(FakeSetup& setup, bool stage_coordinates);

 private:
  // Takes the capture at a pose given as a distance from the start; returns what it measures of the score.
  double capture(const Pose& moved, std::uint32_t step);

  plugin_host::Scene scene_;
  trials::SceneFacts facts_;
  trials::Perturbations drawn_;
  plugin_host::MountedAssembly assembly_;
  std::vector<float> reference_, shown_;
};

}  // namespace relign::conformance
