#include "runner/scene_files.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <vector>

#include "records/record.h"

namespace relign::runner {
namespace {

// The same for all poses, so that neighbouring estimates have nearly equal errors and lines are smooth.
constexpr std::uint64_t kTruthSeed = 4;
constexpr int kTimed = 5;
// Distances from the nominal pose as fractions of the travel: dense where the error falls steeply.
constexpr double kAway[] = {0.01, 0.025, 0.05, 0.1, 0.2, 0.35, 0.5};
constexpr int kPlaneSteps = 4;  // to each side
constexpr double kPlaneStep = 0.03;

bool inside(double share) { return share >= 0 && share <= 1; }

std::vector<double> line_shares(double nominal) {
  std::vector<double> shares = {nominal};
  for (const double away : kAway)
    for (const double share : {nominal - away, nominal + away})
      if (inside(share)) shares.push_back(share);
  for (const double end : {0.0, 1.0})  // if the nominal pose is off centre
    if (std::fabs(end - nominal) > kAway[std::size(kAway) - 1]) shares.push_back(end);
  std::sort(shares.begin(), shares.end());
  return shares;
}

std::vector<double> plane_shares(double nominal) {
  std::vector<double> shares;
  for (int step = -kPlaneSteps; step <= kPlaneSteps; ++step)
    if (const double share = nominal + step * kPlaneStep; inside(share)) shares.push_back(share);
  return shares;
}

struct Stopped {};

class Values {
 public:
  Values(plugin_host::Scene& scene, const std::atomic<bool>* stop) : lens_(scene.mount("{}")), stop_(stop) {}

  double mse(const std::vector<double>& pose) {
    if (stop_ && stop_->load()) throw Stopped();
    return lens_.noise_free_mse(pose, kTruthSeed).mse;
  }

  bool too_slow(const std::vector<double>& pose) {
    double fastest = kMaxLandscapeValueSeconds * 2;
    for (int k = 0; k < kTimed; ++k) {
      const auto begin = std::chrono::steady_clock::now();
      mse(pose);
      fastest = std::min(fastest, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
      if (fastest <= kMaxLandscapeValueSeconds) return false;
    }
    return true;
  }

 private:
  plugin_host::MountedAssembly lens_;
  const std::atomic<bool>* stop_;
};

}  // namespace

// Non-finite values are written as null.
Json measure_landscape(plugin_host::Scene& scene, const trials::SceneFacts& facts, const std::atomic<bool>* stop) {
  if (facts.owns_stage || !facts.truth || facts.axes.empty()) return nullptr;
  try {
    Values values(scene, stop);
    const std::vector<double>& nominal = facts.nominal_pose;
    if (values.too_slow(nominal)) return nullptr;
    Json lines = Json::array();
    for (std::size_t axis = 0; axis < facts.axes.size(); ++axis) {
      const std::vector<double> shares = line_shares(nominal[axis]);
      Json mse = Json::array();
      for (const double share : shares) {
        std::vector<double> pose = nominal;
        pose[axis] = share;
        mse.push_back(values.mse(pose));
      }
      lines.push_back({{"axis", facts.axes[axis].name}, {"shares", shares}, {"mse", std::move(mse)}});
    }
    Json landscape = {
        {"format", records::kFormat}, {"lens", "perfect"}, {"pose", nominal}, {"lines", std::move(lines)}};
    if (facts.axes.size() < 2) return landscape;
    const std::size_t across = 0, up = facts.axes.size() - 1;
    const std::vector<double> columns = plane_shares(nominal[across]), rows = plane_shares(nominal[up]);
    Json mse = Json::array();
    for (const double row : rows)
      for (const double column : columns) {
        std::vector<double> pose = nominal;
        pose[across] = column;
        pose[up] = row;
        mse.push_back(values.mse(pose));
      }
    landscape["plane"] = {{"across", facts.axes[across].name},
                          {"up", facts.axes[up].name},
                          {"across_shares", columns},
                          {"up_shares", rows},
                          {"mse", std::move(mse)}};
    return landscape;
  } catch (const Stopped&) {
    return nullptr;
  }
}

}  // namespace relign::runner
