#include "cli/tolerance_table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "base/displayed_rmse.h"
#include "base/error.h"
#include "base/json_members.h"
#include "base/seeds.h"
#include "base/text.h"
#include "cli/text_table.h"
#include "trials/tolerance_model.h"

namespace relign::cli {
namespace {

double root(double square) { return std::sqrt(std::max(square, 0.0)); }

// Two significant digits: RMSE of well-made lenses are far below 0.001.
std::string shown(double value) {
  if (std::isinf(value)) return "outside the travel";
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

std::string percent(double share) { return fixed(std::round(1000 * share) / 10 + 0.0, 1) + " %"; }

// Where the searches contradict the prediction.
std::string warning(const std::vector<ToleranceTable::Lens>& checked, double spec) {
  constexpr double kFactor = 1.5;
  std::size_t worse = 0, failing = 0;
  for (const ToleranceTable::Lens& lens : checked) {
    const bool above_noise = lens.found > lens.found_error;
    if (above_noise && lens.found > kFactor * lens.predicted + lens.found_error) ++worse;
    if (above_noise && spec > 0 && lens.predicted <= spec && lens.found > spec) ++failing;
  }
  std::string text;
  const std::string of = " of " + std::to_string(checked.size()) + " ";
  if (failing > 0)
    text +=
        "Warning: " + std::to_string(failing) + of +
        "miss the specification that they are predicted to meet. Do not trust this yield: effects of\nsecond order, "
        "which the prediction leaves out, are strong.\n";
  else if (worse > 0)
    text += "Warning: " + std::to_string(worse) + of + "are worse than predicted by more than " + fixed(kFactor, 1) +
            " times. Take the prediction as a lower limit of the RMSE.\n";
  return text;
}

double quantile(const std::vector<double>& sorted, double share) {
  return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
}

double yield(const std::vector<double>& sorted, double spec) {
  const auto end = std::upper_bound(sorted.begin(), sorted.end(), spec);
  return static_cast<double>(end - sorted.begin()) / static_cast<double>(sorted.size());
}

// shares: of each offset in what alignment leaves, 1 in all.
std::vector<ToleranceTable::Offset> rows_of(const trials::ToleranceModel& model, const Eigen::MatrixXd& drawn,
                                            const Eigen::VectorXd& shares, const trials::SceneFacts& facts) {
  const Eigen::VectorXd deviations = (drawn.rowwise().squaredNorm() / static_cast<double>(drawn.cols())).cwiseSqrt();
  std::vector<ToleranceTable::Offset> offsets;
  for (Eigen::Index i = 0; i < deviations.size(); ++i) {
    if (deviations[i] == 0) continue;
    const Eigen::Index number = i % trials::kOffsetsAnElement;
    offsets.push_back({facts.elements[static_cast<std::size_t>(i / trials::kOffsetsAnElement)],
                       trials::kOffsetNames[number], number < 3 ? "mm" : "deg", deviations[i],
                       deviations[i] * root(model.at_nominal(i, i)), deviations[i] * root(model.aligned(i, i)),
                       shares[i]});
  }
  std::stable_sort(offsets.begin(), offsets.end(), [](const auto& a, const auto& b) { return a.share > b.share; });
  return offsets;
}

}  // namespace

ToleranceTable tolerance_table(const LoadedScene& scene, const plugin_host::Choice& level,
                               const plugin_host::HostServices& services, unsigned draws, unsigned checked,
                               std::uint32_t samples) {
  constexpr double kMostError = 0.3;
  plugin_host::MountedAssembly design = scene.scene->mount("{}");
  const auto model = trials::tolerance_model(design, scene.facts, samples);
  if (!model)
    throw Error(ErrorKind::bad_input,
                "--scene: the images of '" + scene.choice.id + "' have no derivatives; " + kScenesWithDerivatives);
  // Training seeds: none of these lenses is an instance of a benchmark.
  plugin_host::NoiseLevel drawing(level, services);
  Eigen::MatrixXd drawn(model->aligned.rows(), draws);
  std::vector<trials::Instance> lenses;
  for (unsigned k = 0; k < draws; ++k) {
    trials::Instance lens = trials::draw_instance(drawing, scene.facts, 0, SeedDomain::training, k);
    drawn.col(k) = trials::offsets_of(lens.perturbations.elements_json, scene.facts);
    if (k < checked) lenses.push_back(std::move(lens));
  }
  ToleranceTable table;
  if (drawn.isZero(0)) return table;
  const Eigen::MatrixXd parts = drawn.cwiseProduct(model->aligned * drawn);
  const Eigen::VectorXd left = parts.colwise().sum();
  const Eigen::VectorXd errors = drawn.cwiseProduct(model->error * drawn).colwise().sum();
  const double mean = left.mean();
  table.error = mean > 0 ? std::sqrt(errors.squaredNorm() / draws) / mean : 1;
  if (table.error > kMostError)
    throw Error(ErrorKind::bad_input,
                "--samples: " + std::to_string(samples) +
                    " rays per pixel are too few, the noise of the derivatives hides what alignment leaves; try " +
                    std::to_string(std::min<std::uint64_t>(16ULL * samples, 65'536)));
  table.offsets = rows_of(*model, drawn, parts.rowwise().sum() / left.sum(), scene.facts);
  const Eigen::Map<const Eigen::VectorXd> nominal(scene.facts.nominal_pose.data(), model->moves.rows());
  for (unsigned k = 0; k < draws; ++k) {
    const Eigen::VectorXd best = nominal + model->moves * drawn.col(k);
    const bool inside = best.minCoeff() >= 0 && best.maxCoeff() <= 1;
    if (!inside) ++table.outside;
    table.predicted.push_back(inside ? root(left[k]) : std::numeric_limits<double>::infinity());
  }
  for (std::size_t k = 0; k < lenses.size(); ++k) {
    const auto found = scene.scene->mount(lenses[k].perturbations.elements_json)
                           .own_optimum(frame_seed(lenses[k].seed, 0, FrameStream::own_optimum));
    if (!found)
      throw Error(ErrorKind::bad_input,
                  "--scene: '" + scene.choice.id + "' does not search for the best pose of a lens; use --check 0");
    table.checked.push_back({table.predicted[k], displayed_rmse(found->mse), root(2 * found->standard_error)});
  }
  std::sort(table.predicted.begin(), table.predicted.end());
  return table;
}

std::string tolerances_text(const ToleranceTable& table, double spec) {
  if (table.offsets.empty()) return "This noise level moves no element.\n";
  std::string text = "RMSE of " + std::to_string(table.predicted.size()) +
                     " drawn lenses at their best poses, predicted to first order: median " +
                     shown(quantile(table.predicted, 0.5)) + ", 95 % quantile " +
                     shown(quantile(table.predicted, 0.95)) +
                     " (standard error of the mean square: " + percent(table.error) + ").\n";
  if (table.outside > 0) text += std::to_string(table.outside) + " of them have their best pose outside the travel.\n";
  if (spec > 0)
    text += "Predicted yield: " + percent(yield(table.predicted, spec)) + " can be aligned to an RMSE of " +
            shortest(spec) + ".\n";
  if (!table.checked.empty()) {
    text += "Found by search, for " + std::to_string(table.checked.size()) + " of them (predicted):";
    for (const ToleranceTable::Lens& lens : table.checked)
      text += " " + (lens.found > lens.found_error ? shown(lens.found) : "under " + shown(lens.found_error)) + " (" +
              shown(lens.predicted) + ")";
    text += ".\n" + warning(table.checked, spec);
  }
  TextTable rows({"element", "offset", "drawn", "unit", "RMSE", "aligned", "share"});
  for (const ToleranceTable::Offset& offset : table.offsets)
    rows.add({offset.element, offset.name, fixed(offset.deviation, 4), offset.unit, shown(offset.at_nominal),
              shown(offset.aligned), percent(offset.share)});
  return text +
         "\nBy offset, for its root mean square: RMSE at the nominal pose, what alignment leaves of it, and its share "
         "of the mean\nsquare that alignment leaves (below 0: noise, or it makes up for another offset).\n" +
         rows.text();
}

Json tolerances_json(const ToleranceTable& table, double spec) {
  if (table.offsets.empty()) return {{"lenses", 0}, {"offsets", Json::array()}};
  Json json = {{"lenses", table.predicted.size()},
               {"outside_travel", table.outside},
               {"error_of_mean_square", table.error},
               {"rmse",
                {{"median", number_or_null(quantile(table.predicted, 0.5))},
                 {"q95", number_or_null(quantile(table.predicted, 0.95))}}},
               {"offsets", Json::array()},
               {"checked", Json::array()}};
  if (spec > 0) json["specification"] = {{"rmse", spec}, {"yield", yield(table.predicted, spec)}};
  for (const ToleranceTable::Offset& offset : table.offsets)
    json["offsets"].push_back({{"element", offset.element},
                               {"offset", offset.name},
                               {"unit", offset.unit},
                               {"root_mean_square", offset.deviation},
                               {"rmse_at_nominal", offset.at_nominal},
                               {"rmse_aligned", offset.aligned},
                               {"share", offset.share}});
  for (const ToleranceTable::Lens& lens : table.checked)
    json["checked"].push_back(
        {{"predicted", number_or_null(lens.predicted)}, {"found", lens.found}, {"found_error", lens.found_error}});
  return json;
}

}  // namespace relign::cli
