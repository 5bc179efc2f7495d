#include "conformance/trial_scene.h"

#include <algorithm>
#include <filesystem>

#include "base/error.h"
#include "base/seeds.h"
#include "conformance/conduct.h"
#include "conformance/subject.h"
#include "trials/instance.h"
#include "trials/protocol.h"
#include "trials/task_text.h"

namespace relign::conformance {

using plugin_host::Catalog;
using plugin_host::Choice;
using plugin_host::Kind;

namespace {

Choice declared_level() {
  Catalog installed;
  for (const std::filesystem::path& root : Catalog::default_roots()) installed.scan(root);
  return installed.resolve_or_throw(Kind::noise_level, "declared");
}

// As built, and where a trial starts.
trials::Perturbations drawn_for(const trials::SceneFacts& facts) {
  trials::Perturbations drawn;
  if (!facts.uncertain.empty()) {
    plugin_host::NoiseLevel level(declared_level(), check_services());
    return trials::draw_instance(level, facts, 1, SeedDomain::tuning, 0).perturbations;
  }
  drawn.elements_json = "{}";
  drawn.start = facts.nominal_pose;
  for (std::size_t axis = 0; axis < drawn.start.size(); ++axis)
    drawn.start[axis] = std::clamp(drawn.start[axis] + (axis % 2 ? -0.11 : 0.13), 0.0, 1.0);
  return drawn;
}

trials::SceneFacts facts_of(plugin_host::Scene& scene, const std::string& id) {
  trials::SceneFacts facts = trials::read_scene_facts(scene.describe(), id);
  if (facts.owns_stage)
    throw Error(ErrorKind::bad_input,
                "scene '" + id + "' is a station, which would move; check the method on a simulated scene");
  return facts;
}

}  // namespace

TrialScene::TrialScene(const Choice& choice)
    : scene_(choice, check_services()),
      facts_(facts_of(scene_, choice.id)),
      drawn_(drawn_for(facts_)),
      assembly_(scene_.mount(drawn_.elements_json)) {
  reference_ = packed(scene_.reference());
  shown_.resize(reference_.size());
}

double TrialScene::capture(const Pose& moved, std::uint32_t step) {
  Pose pose = drawn_.start;  // true; a stage stops at the ends of its travel
  for (std::size_t axis = 0; axis < pose.size(); ++axis) pose[axis] = std::clamp(pose[axis] + moved[axis], 0.0, 1.0);
  assembly_.capture(pose, step + 1, shown_.data());
  return facts_.measured(shown_.data(), reference_.data());
}

void TrialScene::fill(FakeSetup& setup, bool stage_coordinates) {
  setup.axes = axes();
  setup.start = stage_coordinates ? drawn_.start : Pose(setup.axes, 0.0);
  setup.lower = setup.upper = setup.start;
  for (double& end : setup.lower) end -= trials::kBlindHalfBox;
  for (double& end : setup.upper) end += trials::kBlindHalfBox;
  setup.axes_json = trials::axes_text(facts_);
  setup.readings_json = trials::readings_text(facts_);
  setup.merit = [this, start = setup.start](const Pose& pose, std::uint32_t step) {
    Pose moved = pose;
    for (std::size_t axis = 0; axis < moved.size(); ++axis) moved[axis] -= start[axis];
    return capture(moved, step);
  };
  setup.image_side = facts_.image_width;
  setup.image_height = facts_.image_height;
  setup.paint = [this](double, float* pixels) { std::copy(shown_.begin(), shown_.end(), pixels); };
  setup.reference = reference_;
}

}  // namespace relign::conformance
