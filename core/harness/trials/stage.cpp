#include "trials/stage.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/seeds.h"

namespace relign::trials {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

class SimulatedStage final : public Stage {
 public:
  SimulatedStage(plugin_host::MountedAssembly& assembly, const TrialSetup& setup, const Rules& rules)
      : assembly_(assembly),
        setup_(setup),
        machine_time_(setup.terms.machine_time),
        motion_(setup.scene, setup.instance, rules.commanded_start, setup.terms.limits, machine_time_) {}

  Arrival start() override { return {motion_.commanded_pose(), motion_.true_pose(), 0, 0, 0}; }

  Arrival step_to(const std::vector<double>& commanded) override {
    StageMotion::Arrival arrival = motion_.step_to(commanded);
    return {std::move(arrival.commanded_pose), std::move(arrival.true_pose), arrival.limits_low, arrival.limits_high,
            arrival.travel_seconds + machine_time_.settle_ms / 1000};
  }

  const std::vector<double>& reached_pose() const override { return motion_.reached_pose(); }

  double capture(unsigned step, const PixelRegions& regions, float* pixels) override {
    const std::uint64_t seed = frame_seed(setup_.instance.seed, step, FrameStream::capture);
    double share = 1;
    if (regions.empty())
      assembly_.capture(motion_.true_pose(), seed, pixels);
    else
      share = *assembly_.capture_regions(motion_.true_pose(), seed, plugin_host::regions_of(regions), pixels);
    const double seconds = (machine_time_.exposure_ms + machine_time_.readout_ms * share) / 1000;
    motion_.wait(seconds);
    return seconds;
  }
  bool captures_regions() const override { return assembly_.captures_regions(); }

  VirtualMove would_reach(const std::vector<double>& commanded) const override {
    StageMotion::Arrival arrival = motion_.would_reach(commanded);
    const double settle = arrival.travel_seconds > 0 ? machine_time_.settle_ms / 1000 : 0;
    const bool shifts = !setup_.instance.perturbations.cure_shift.empty();
    std::vector<double> uncured = shifts ? arrival.true_pose : std::vector<double>();
    return {cured(std::move(arrival.true_pose)), arrival.travel_seconds + settle, std::move(uncured)};
  }

  std::vector<double> cured(std::vector<double> true_pose) const override {
    // The stage's limits do not stop the glue, but a scene accepts only poses within the travel.
    const std::vector<double>& cure_shift = setup_.instance.perturbations.cure_shift;
    for (std::size_t i = 0; i < cure_shift.size(); ++i)
      true_pose[i] = std::clamp(true_pose[i] + cure_shift[i], 0.0, 1.0);
    return true_pose;
  }

  Truth truth_at(const std::vector<double>& true_pose, std::uint64_t seed) override {
    if (!has_ground_truth()) return {kUnknown, kUnknown};
    const auto value = assembly_.noise_free_mse(true_pose, seed);
    return {value.mse, value.standard_error};
  }
  bool has_ground_truth() const override { return setup_.scene.truth; }

 private:
  plugin_host::MountedAssembly& assembly_;
  const TrialSetup& setup_;
  const MachineTime& machine_time_;
  StageMotion motion_;
};

// Commanded coordinates are relative to the start. Where a limit cuts a move, the station's encoders report the reached
// position, so that a commanded pose always means the same place.
class HardwareStage final : public Stage {
 public:
  HardwareStage(plugin_host::Scene& station, std::uint64_t seed, const Rules& rules)
      : station_(station),
        seed_(seed),
        unknown_(rules.commanded_start.size(), kUnknown),
        reached_(rules.commanded_start) {}

  Arrival start() override {
    station_.begin(seed_);
    return {reached_, unknown_, 0, 0, 0};
  }

  Arrival step_to(const std::vector<double>& commanded) override {
    std::vector<double> delta = commanded;
    for (std::size_t i = 0; i < delta.size(); ++i) delta[i] -= reached_[i];
    const plugin_host::Scene::StageMove made = station_.move_by(delta);
    for (std::size_t i = 0; i < delta.size(); ++i)
      // A complete move ends at the commanded pose, bit for bit.
      reached_[i] = made.moved[i] == delta[i] ? commanded[i] : reached_[i] + made.moved[i];
    return {commanded, unknown_, made.limits_low, made.limits_high, made.machine_seconds};
  }

  const std::vector<double>& reached_pose() const override { return reached_; }
  double capture(unsigned, const PixelRegions&, float* pixels) override { return station_.capture(pixels); }
  bool captures_regions() const override { return false; }
  VirtualMove would_reach(const std::vector<double>&) const override { return {unknown_, kUnknown}; }
  std::vector<double> cured(std::vector<double>) const override { return unknown_; }
  Truth truth_at(const std::vector<double>&, std::uint64_t) override { return {kUnknown, kUnknown}; }
  bool has_ground_truth() const override { return false; }

 private:
  plugin_host::Scene& station_;
  std::uint64_t seed_;
  std::vector<double> unknown_;
  std::vector<double> reached_;
};

}  // namespace

std::unique_ptr<Stage> make_stage(const TrialSetup& setup, const Rules& rules) {
  if (const auto* station = std::get_if<Station>(&setup.stage))
    return std::make_unique<HardwareStage>(station->scene, setup.instance.seed, rules);
  return std::make_unique<SimulatedStage>(std::get<SimulatedLens>(setup.stage).assembly, setup, rules);
}

SceneFacts facts_of(plugin_host::Scene& scene, const std::string& scene_id) {
  SceneFacts facts = read_scene_facts(scene.describe(), scene_id);
  if (facts.owns_stage != scene.offers_stage())
    throw Error(
        ErrorKind::plugin_failed,
        "scene '" + scene_id + "': " +
            (facts.owns_stage ? "its description has \"owns_stage\": true, but it does not offer "
                                "" RELIGN_SCENE_STAGE
                              : "it offers " RELIGN_SCENE_STAGE ", but its description lacks \"owns_stage\": true"));
  return facts;
}

}  // namespace relign::trials
