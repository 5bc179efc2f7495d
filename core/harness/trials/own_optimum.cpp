#include "trials/own_optimum.h"

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <utility>
#include <vector>

#include "relign/random.hpp"

namespace relign::trials {
namespace {

using plugin_host::MountedAssembly;

class Search {
 public:
  Search(MountedAssembly& assembly, const SceneFacts& scene, std::uint64_t seed)
      : assembly_(assembly), scene_(scene), seed_(seed), pose_(scene.nominal_pose), axes_(scene.observable_axes()) {}

  std::optional<MountedAssembly::Optimum> run() {
    constexpr int kDrawn = 3;
    constexpr double kStride = 0.1, kSmallStride = 0.005;  // shares of the travel
    Random random(seed_);
    std::vector<double> start;
    for (const std::size_t axis : axes_) start.push_back(scene_.nominal_pose[axis]);
    consider(start);
    for (int drawn = 0; drawn <= kDrawn && !axes_.empty(); ++drawn) {
      descend(start, kStride);
      for (double& value : start) value = random.uniform();
    }
    if (!axes_.empty()) descend(best_, kSmallStride);
    std::vector<double> pose = posed(best_);
    for (double& value : pose) value = std::round(value * kDecimals) / kDecimals;
    const MountedAssembly::Truth there = assembly_.noise_free_mse(pose, seed_);
    return MountedAssembly::Optimum{std::move(pose), there.mse, there.standard_error};
  }

 private:
  static constexpr double kDecimals = 1e6;
  static constexpr int kScoresPerAxis = 60;

  const std::vector<double>& posed(const std::vector<double>& along) {
    for (std::size_t i = 0; i < axes_.size(); ++i) pose_[axes_[i]] = std::clamp(along[i], 0.0, 1.0);
    return pose_;
  }

  double consider(const std::vector<double>& along) {
    const double score = assembly_.noise_free_mse(posed(along), seed_).mse;
    if (best_.empty() || score < lowest_) {
      best_ = along;
      lowest_ = score;
    }
    return score;
  }

  // An error of the scene passes through NLopt, which rethrows what an objective throws.
  void descend(std::vector<double> along, double stride) {
    const auto count = static_cast<unsigned>(axes_.size());
    nlopt::opt opt(count > 1 ? nlopt::LN_BOBYQA : nlopt::LN_SBPLX, count);
    opt.set_lower_bounds(0);
    opt.set_upper_bounds(1);
    opt.set_initial_step(stride);
    opt.set_xtol_abs(1 / kDecimals);
    opt.set_maxeval(kScoresPerAxis * static_cast<int>(count));
    opt.set_min_objective([](const std::vector<double>& x, std::vector<double>&,
                             void* self) { return static_cast<Search*>(self)->consider(x); },
                          this);
    double lowest = 0;
    try {
      opt.optimize(along, lowest);
    } catch (const nlopt::roundoff_limited&) {  // as good as it gets
    }
  }

  MountedAssembly& assembly_;
  const SceneFacts& scene_;
  std::uint64_t seed_;
  std::vector<double> pose_;
  std::vector<std::size_t> axes_;  // observable ones
  std::vector<double> best_;       // along them
  double lowest_ = 0;
};

}  // namespace

std::optional<MountedAssembly::Optimum> own_optimum(MountedAssembly& assembly, const SceneFacts& scene,
                                                    std::uint64_t seed) {
  if (auto known = assembly.own_optimum(seed)) return known;
  if (!scene.searches_optimum) return std::nullopt;
  return Search(assembly, scene, seed).run();
}

}  // namespace relign::trials
