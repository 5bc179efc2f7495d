// The error landscape around the nominal pose of a scene.
#include "base/json_members.h"
#include "report/figures.h"
#include "report/page_data.h"

namespace relign::report {
std::optional<Figure> landscape_figure(const Json& facts, std::size_t index) {
  const Json& lines = list_of(object_of(facts, "landscape"), "lines");
  if (lines.empty()) return {};
  Chart chart;
  chart.title = text_of(facts, "scene");
  chart.x = {"% of the travel from the nominal pose", false, false, {}};
  chart.y = {"noise-free error (RMSE)", false, false, {}, 0};
  for (const Json& line : lines) {
    ChartSeries series = {text_of(line, "axis"), static_cast<int>(chart.series.size()), Drawn::line, {}};
    const Json &away = list_of(line, "away"), &rmse = list_of(line, "rmse");
    for (std::size_t k = 0; k < away.size() && k < rmse.size(); ++k)
      series.points.push_back({number_in(away, k), number_in(rmse, k)});
    chart.series.push_back(std::move(series));
  }
  return Figure{"landscape-" + std::to_string(index + 1) + "-" + figure_file_name(text_of(facts, "scene")),
                "Error of the nominal lens, displaced along one axis at a time.", chart};
}

}  // namespace relign::report
