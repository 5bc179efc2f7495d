#include "trials/protocol.h"

#include <relign/plugin.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"

namespace relign::trials {

namespace {
constexpr double kAgentMove = 0.2;  // paper: agents move by at most this per axis and step
constexpr double kBoxLower = 0.2;   // paper: baselines search [0.2, 0.8]^n
constexpr double kBoxUpper = 0.8;
constexpr double kNearDistance = 0.1;  // paper's C: within this distance only the image counts
}  // namespace

const char* protocol_name(Protocol protocol) { return protocol == Protocol::paper ? "paper" : "blind"; }

std::optional<Protocol> protocol_from_name(const std::string& name) {
  if (name == "paper") return Protocol::paper;
  if (name == "blind") return Protocol::blind;
  return std::nullopt;
}

const std::vector<std::string>& merit_names() {
  static const std::vector<std::string> names = {"combined", "rmse", "mtf", "edge_energy"};  // in the order of Merit
  return names;
}

const char* merit_name(Merit merit) { return merit_names().at(static_cast<std::size_t>(merit)).c_str(); }

std::optional<Merit> merit_from_name(const std::string& name) {
  const std::vector<std::string>& names = merit_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<Merit>(found - names.begin());
}

bool needs_fields(Merit merit) { return merit == Merit::mtf || merit == Merit::edge_energy; }

Rules make_rules(Protocol protocol, const plugin_host::Manifest& algorithm, const Instance& instance,
                 const SceneFacts& scene) {
  const std::size_t axes = scene.axes.size();
  const bool agent = algorithm.kind == plugin_host::Kind::agent;
  Rules rules;
  rules.observes = algorithm.observed_bits();
  if (protocol == Protocol::blind) rules.observes &= ~std::uint32_t{RELIGN_OBSERVES_START};
  if (algorithm.oracle) {
    if (scene.owns_stage)
      throw Error(
          ErrorKind::bad_input,
          "'" + algorithm.id + "' requires the true start pose, which is unknown on the station '" + scene.name + "'");
    rules.observes |= RELIGN_OBSERVES_START;
  }
  if (scene.owns_stage) rules.observes &= ~std::uint32_t{RELIGN_OBSERVES_START};

  if (rules.observes & RELIGN_OBSERVES_START) {
    rules.commanded_start = instance.perturbations.start;
    rules.box_lower.assign(axes, kBoxLower);
    rules.box_upper.assign(axes, kBoxUpper);
  } else {
    rules.commanded_start.assign(axes, 0.0);
    rules.box_lower.assign(axes, -kBlindHalfBox);
    rules.box_upper.assign(axes, kBlindHalfBox);
  }
  const bool short_moves = agent && protocol == Protocol::paper;
  rules.largest_move = short_moves ? kAgentMove : std::numeric_limits<double>::infinity();
  rules.merit = protocol == Protocol::paper && !scene.owns_stage ? Merit::combined : Merit::rmse;
  rules.recommend_current = agent;
  return rules;
}

double combined_merit(double rmse, const std::vector<double>& true_pose, const std::vector<double>& nominal_pose) {
  double squares = 0;
  for (std::size_t i = 0; i < true_pose.size(); ++i) {
    const double difference = true_pose[i] - nominal_pose[i];
    squares += difference * difference;
  }
  const double distance = std::sqrt(squares);
  return distance > kNearDistance ? rmse + distance : rmse;
}

}  // namespace relign::trials
