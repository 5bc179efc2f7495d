// The error landscape around the nominal pose of a scene.
#include "report/figures.h"

namespace relign::report {

std::optional<Figure> landscape_figure(const SceneFacts& facts, std::size_t index) {
  if (facts.landscape.empty()) return {};
  Chart chart;
  chart.title = facts.scene;
  chart.x = {"% of the travel from the nominal pose", false, false, {}};
  chart.y = {"noise-free error (RMSE)", false, false, {}, 0};
  for (const LandscapeLine& line : facts.landscape) {
    ChartSeries series = {line.axis, static_cast<int>(chart.series.size()), Drawn::line, {}};
    for (std::size_t k = 0; k < line.away.size(); ++k) series.points.push_back({line.away[k], line.rmse[k]});
    chart.series.push_back(std::move(series));
  }
  return Figure{"landscape-" + std::to_string(index + 1) + "-" + figure_file_name(facts.scene),
                "Error of the nominal lens, displaced along one axis at a time.", chart};
}

}  // namespace relign::report
