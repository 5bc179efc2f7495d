#include "cli/optimum_table.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/seeds.h"
#include "base/text.h"
#include "cli/text_table.h"
#include "cli/workbench.h"
#include "trials/own_optimum.h"

namespace relign::cli {
namespace {

LevelOptima::Spread spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  const double median = values.size() % 2 ? values[half] : (values[half - 1] + values[half]) / 2;
  return {median, values.back()};
}

// Euclidean distance of a pose from the nominal pose over the axes with this unit.
double distance(const trials::SceneFacts& facts, const std::vector<double>& pose, const char* unit) {
  double squares = 0;
  for (std::size_t i = 0; i < facts.axes.size(); ++i)
    if (facts.axes[i].unit == unit) squares += std::pow((pose[i] - facts.nominal_pose[i]) * facts.axes[i].travel(), 2);
  return std::sqrt(squares);
}

}  // namespace

std::vector<LevelOptima> level_optima(Context& context, const std::string& scene,
                                      const std::vector<std::string>& levels, unsigned instances) {
  const LoadedScene loaded = load_scene(named_choice(context.catalog(), plugin_host::Kind::scene, scene, "--scene"),
                                        context.services(core_count()));
  std::vector<LevelOptima> table;
  for (const std::string& name : levels) {
    const plugin_host::Choice level =
        named_choice(context.catalog(), plugin_host::Kind::noise_level, name, "--noise-level");
    std::vector<double> shifts, tilts, own, nominal;
    for (std::uint64_t number = 0; number < instances; ++number) {
      const trials::Instance instance = draw_instance(level, loaded, context.services(1), 1, number);
      plugin_host::MountedAssembly lens = loaded.scene->mount(instance.perturbations.elements_json);
      const std::uint64_t seed = frame_seed(instance.seed, 0, FrameStream::own_optimum);
      const auto found = trials::own_optimum(lens, loaded.facts, seed);
      if (!found)
        throw Error(ErrorKind::bad_input, "--noise-level: scene '" + scene +
                                              "' does not have the optimum of an instance; its description may ask "
                                              "for a search, \"own_optimum\": \"searched\"");
      shifts.push_back(distance(loaded.facts, found->true_pose, "mm"));
      tilts.push_back(distance(loaded.facts, found->true_pose, "deg"));
      own.push_back(loaded.facts.score.shown(found->mse));
      nominal.push_back(loaded.facts.score.shown(lens.noise_free_mse(loaded.facts.nominal_pose, seed).mse));
    }
    table.push_back(
        {loaded.facts.score.name, name, own.size(), spread(shifts), spread(tilts), spread(own), spread(nominal)});
  }
  return table;
}

std::string optima_text(const std::vector<LevelOptima>& levels) {
  const std::string score = levels.empty() ? SceneScore().name : levels.front().score;
  TextTable table({"level", "instances", "optimum from nominal: mm", "largest", "deg", "largest", score + " there",
                   "largest", score + " at nominal"});
  for (const LevelOptima& level : levels)
    table.add({level.level, std::to_string(level.instances), fixed(level.shift_mm.median, 4),
               fixed(level.shift_mm.largest, 4), fixed(level.tilt_deg.median, 3), fixed(level.tilt_deg.largest, 3),
               fixed(level.own_rmse.median, 5), fixed(level.own_rmse.largest, 5), fixed(level.nominal_rmse.median, 5)});
  return "Medians over instances; errors are noise-free.\n" + table.text();
}

Json optima_json(const std::vector<LevelOptima>& levels) {
  Json list = Json::array();
  const auto both = [](const LevelOptima::Spread& of) { return Json{{"median", of.median}, {"largest", of.largest}}; };
  for (const LevelOptima& level : levels)
    list.push_back({{"noise_level", level.level},
                    {"lenses", level.instances},
                    {"shift_mm", both(level.shift_mm)},
                    {"tilt_deg", both(level.tilt_deg)},
                    {"own_rmse", both(level.own_rmse)},
                    {"nominal_rmse", both(level.nominal_rmse)}});
  return list;
}

}  // namespace relign::cli
