// Protocols: what an algorithm may observe, and the coordinates of its poses.
//
// paper  optimizers get the true start and the box [0.2, 0.8]^n and move without a step limit;
//        merit = combined: measured RMSE, plus the distance to the nominal pose while that is above 0.1.
//        Agents get images and move by up to 0.2 per axis and step.
// blind  coordinates are relative to the unknown start; box = start +- 0.5 per axis; merit = measured RMSE;
//        each step reports which axes met a limit.
// An entry of a suite may choose another merit: combined, rmse, or one by field (field_merit.h).
// On a station start and true pose are unknown: under both protocols coordinates are relative to the
// start, box = start +- 0.5, merit = measured RMSE; algorithms that require the start cannot run.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "plugin_host/manifest.h"
#include "trials/instance.h"
#include "trials/scene_facts.h"

namespace relign::trials {

enum class Protocol { paper, blind };

// Of the box of "blind", around the unknown start: contains the nominal pose for every start in the middle of the
// travel.
constexpr double kBlindHalfBox = 0.5;
enum class Merit { combined, rmse, mtf, edge_energy };

// Limits of merit mtf, from the specification's "mtf". NaN: none.
struct MtfLimits {
  double lp_per_mm = std::numeric_limits<double>::quiet_NaN();
  double centre = lp_per_mm, corner = lp_per_mm;
  bool limits_anything() const { return lp_per_mm > 0 && !(std::isnan(centre) && std::isnan(corner)); }
};

const char* protocol_name(Protocol protocol);
std::optional<Protocol> protocol_from_name(const std::string& name);
const char* merit_name(Merit merit);
std::optional<Merit> merit_from_name(const std::string& name);
const std::vector<std::string>& merit_names();
bool needs_fields(Merit merit);

// The rules of one trial, derived from protocol, algorithm and instance.
struct Rules {
  std::uint32_t observes = 0;           // granted RELIGN_OBSERVES_* bits
  std::vector<double> commanded_start;  // coordinates of the start pose
  std::vector<double> box_lower;        // commanded coordinates; always filled, granted by observes
  std::vector<double> box_upper;
  double largest_move = 0;  // infinity when unlimited
  Merit merit = Merit::combined;
  bool recommend_current = false;  // default recommendation: current pose (agents), else best measured
};

// Throws Error(bad_input) for an algorithm that requires the start on a station.
Rules make_rules(Protocol protocol, const plugin_host::Manifest& algorithm, const Instance& instance,
                 const SceneFacts& scene);

// The paper's reward with opposite sign: rmse + distance while distance > 0.1, else rmse;
// distance = Euclidean norm of true pose minus nominal pose, in fractions of the travel.
double combined_merit(double rmse, const std::vector<double>& true_pose, const std::vector<double>& nominal_pose);

}  // namespace relign::trials
