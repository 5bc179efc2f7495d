#include "cli/tolerance_table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/displayed_rmse.h"
#include "base/error.h"
#include "base/seeds.h"
#include "base/text.h"
#include "cli/text_table.h"
#include "trials/tolerance_model.h"

namespace relign::cli {
namespace {

double root(double square) { return std::sqrt(std::max(square, 0.0)); }

// Two significant digits: RMSE of well-made lenses are far below 0.001.
std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

std::string percent(double share) { return fixed(std::round(1000 * share) / 10 + 0.0, 1) + " %"; }

double quantile(const std::vector<double>& sorted, double share) {
  return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
}

double yield(const std::vector<double>& sorted, double spec) {
  const auto end = std::upper_bound(sorted.begin(), sorted.end(), spec);
  return static_cast<double>(end - sorted.begin()) / static_cast<double>(sorted.size());
}

std::vector<ToleranceTable::Offset> offsets_of(const trials::ToleranceModel& model, const Eigen::MatrixXd& drawn,
                                               const trials::SceneFacts& facts) {
  const auto lenses = static_cast<double>(drawn.cols());
  const Eigen::VectorXd deviations = (drawn.rowwise().squaredNorm() / lenses).cwiseSqrt();
  const Eigen::VectorXd shares = drawn.cwiseProduct(model.aligned * drawn).rowwise().sum() / lenses;
  const double all = std::max(shares.sum(), 1e-300);
  std::vector<ToleranceTable::Offset> offsets;
  for (Eigen::Index i = 0; i < deviations.size(); ++i) {
    if (deviations[i] == 0) continue;
    const Eigen::Index number = i % trials::kOffsetsAnElement;
    offsets.push_back({facts.elements[static_cast<std::size_t>(i / trials::kOffsetsAnElement)],
                       trials::kOffsetNames[number], number < 3 ? "mm" : "deg", deviations[i],
                       deviations[i] * root(model.at_nominal(i, i)), deviations[i] * root(model.aligned(i, i)),
                       shares[i] / all});
  }
  std::stable_sort(offsets.begin(), offsets.end(), [](const auto& a, const auto& b) { return a.share > b.share; });
  return offsets;
}

}  // namespace

ToleranceTable tolerance_table(const LoadedScene& scene, const plugin_host::Choice& level,
                               const plugin_host::HostServices& services, unsigned draws, unsigned checked,
                               std::uint32_t samples) {
  plugin_host::MountedAssembly design = scene.scene->mount("{}");
  const auto model = trials::tolerance_model(design, scene.facts, samples);
  if (!model)
    throw Error(ErrorKind::bad_input,
                "--scene: '" + scene.choice.id + "' offers no derivatives of its images, with these parameters");
  // Training seeds: none of these lenses is an instance of a benchmark.
  plugin_host::NoiseLevel drawing(level, services);
  Eigen::MatrixXd drawn(model->aligned.rows(), draws);
  ToleranceTable table;
  for (unsigned k = 0; k < draws; ++k) {
    const trials::Instance lens = trials::draw_instance(drawing, scene.facts, 0, SeedDomain::training, k);
    drawn.col(k) = trials::offsets_of(lens.perturbations.elements_json, scene.facts);
    table.predicted.push_back(root(drawn.col(k).dot(model->aligned * drawn.col(k))));
    if (k >= checked) continue;
    const auto found = scene.scene->mount(lens.perturbations.elements_json)
                           .own_optimum(frame_seed(lens.seed, 0, FrameStream::own_optimum));
    if (!found)
      throw Error(ErrorKind::bad_input,
                  "--scene: '" + scene.choice.id + "' does not search for the best pose of a lens; use --check 0");
    table.checked.push_back({table.predicted.back(), displayed_rmse(found->mse)});
  }
  table.offsets = offsets_of(*model, drawn, scene.facts);
  std::sort(table.predicted.begin(), table.predicted.end());
  return table;
}

std::string tolerances_text(const ToleranceTable& table, double spec) {
  if (table.offsets.empty()) return "This noise level moves no element.\n";
  std::string text = "RMSE of " + std::to_string(table.predicted.size()) + " drawn lenses" +
                     " at their best poses, predicted from derivatives at the nominal pose: median " +
                     shown(quantile(table.predicted, 0.5)) + ", 95 % below " + shown(quantile(table.predicted, 0.95)) +
                     ".\n";
  if (spec > 0)
    text +=
        "Yield: " + percent(yield(table.predicted, spec)) + " can be aligned to an RMSE of " + shortest(spec) + ".\n";
  if (!table.checked.empty()) {
    text += "Found by search, for " + std::to_string(table.checked.size()) + " of them" + " (predicted):";
    for (const ToleranceTable::Lens& lens : table.checked)
      text += " " + shown(lens.found) + " (" + shown(lens.predicted) + ")";
    text += ".\n";
  }
  TextTable rows({"element", "offset", "drawn", "unit", "RMSE", "aligned", "share"});
  for (const ToleranceTable::Offset& offset : table.offsets)
    rows.add({offset.element, offset.name, fixed(offset.deviation, 4), offset.unit, shown(offset.at_nominal),
              shown(offset.aligned), percent(offset.share)});
  return text +
         "\nBy offset, for its root mean square: RMSE at the nominal pose, what alignment leaves of it, and its share "
         "of " +
         "the mean square that alignment leaves. Second-order effects are left out.\n" + rows.text();
}

Json tolerances_json(const ToleranceTable& table, double spec) {
  Json json = {{"lenses", table.predicted.size()},
               {"rmse", {{"median", quantile(table.predicted, 0.5)}, {"q95", quantile(table.predicted, 0.95)}}},
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
    json["checked"].push_back({{"predicted", lens.predicted}, {"found", lens.found}});
  return json;
}

}  // namespace relign::cli
