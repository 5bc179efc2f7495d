// Figures of the aggregates: performance profiles and convergence.
#include <algorithm>

#include "report/figures.h"

namespace relign::report {
namespace {

// A method with several trainings has the style of the first, which has a curve of its own in other charts.
int aggregate_style(const PageModel& page, const std::map<std::string, int>& styles, const AggregateMethod& method,
                    const std::string& protocol) {
  if (method.oracle()) return kOracleStyle;
  auto found = styles.find(style_key(method.method, protocol));
  if (found == styles.end() && !method.trainings.empty())
    found = styles.find(style_key(method.method + " (" + method.trainings.front().name + ")", protocol));
  return found == styles.end() ? static_cast<int>(page.methods.size()) : found->second;
}

}  // namespace

std::vector<Figure> aggregate_figures(const PageModel& page, std::size_t index, std::size_t most) {
  const Aggregate& aggregate = page.aggregates[index];
  const std::map<std::string, int> styles = method_styles(page);
  const std::vector<double> places = shown(statistics::profile_places());
  Chart profile, progress;
  for (const AggregateMethod& method : aggregate.methods) {
    if (profile.series.size() >= most || !method.has_numbers()) continue;
    const int style = aggregate_style(page, styles, method, aggregate.protocol);
    ChartSeries spread = {method.method, style, Drawn::line, {}}, falling = {method.method, style, Drawn::steps, {}};
    for (std::size_t i = 0; i < places.size() && i < method.bands.profile.size(); ++i) {
      const statistics::Band& share = method.bands.profile[i];
      spread.points.push_back({places[i], 100 * share.estimate, 100 * share.interval.low, 100 * share.interval.high});
    }
    for (std::size_t step = 1; step < method.by_step.size(); ++step)
      falling.points.push_back({static_cast<double>(step), method.by_step[step]});
    profile.series.push_back(std::move(spread));
    progress.series.push_back(std::move(falling));
  }
  if (profile.series.empty()) return {};
  profile.title = progress.title = "all scenes and noise levels, " + aggregate.protocol;
  profile.x = {"normalised error", false, false, {}, 0, 1};
  profile.y = {"instances at or below, %", false, false, {}, 0, 100};
  progress.x = {"images", true, true, {}};
  progress.y = {"mean normalised error", false, false, {}, 0, 1};
  profile.height = progress.height = std::max(300.0, 90 + 12.0 * static_cast<double>(profile.series.size()));
  const std::string file = std::to_string(index + 1) + "-" + figure_file_name(aggregate.protocol);
  return {
      {"profile-" + file,
       "Performance profile: share of instances with a final normalised error at or below the value. Higher is "
       "better; bands are 95 % confidence intervals.",
       profile},
      {"progress-" + file,
       "Convergence: mean normalised error by number of images. The mean of a line over all images is the error-curve "
       "area of the table.",
       progress}};
}

}  // namespace relign::report
