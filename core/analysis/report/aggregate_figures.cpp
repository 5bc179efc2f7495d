// Figures of the aggregates: performance profiles and convergence.
#include <algorithm>

#include "base/json_members.h"
#include "report/figures.h"
#include "report/page_data.h"

namespace relign::report {
namespace {

// A method with several trainings has the style of the first, which has a curve of its own in other charts.
int aggregate_style(const Json& data, const std::map<std::string, int>& styles, const Json& method) {
  if (flag_of(method, "oracle")) return kOracleStyle;
  auto found = styles.find(text_of(method, "method"));
  const Json& trainings = list_of(method, "trainings");
  if (found == styles.end() && !trainings.empty())
    found = styles.find(text_of(method, "method") + " (" + text_of(trainings.front(), "training") + ")");
  return found == styles.end() ? static_cast<int>(data["methods"].size()) : found->second;
}

}  // namespace

std::vector<Figure> aggregate_figures(const Json& data, std::size_t index, std::size_t most) {
  const Json& entry = list_of(data, "aggregate")[index];
  const std::map<std::string, int> styles = method_styles(data);
  Chart profile, progress;
  for (const Json& method : entry["methods"]) {
    if (profile.series.size() >= most || count_of(method, "n") == 0) continue;
    const std::string name = text_of(method, "method");
    const int style = aggregate_style(data, styles, method);
    const Json &places = list_of(entry, "profile_places"), &shares = object_of(method, "profile");
    ChartSeries spread = {name, style, Drawn::line, {}}, falling = {name, style, Drawn::steps, {}};
    for (std::size_t i = 0; i < places.size(); ++i)
      spread.points.push_back({number_in(places, i), 100 * number_in(list_of(shares, "share"), i),
                               100 * number_in(list_of(shares, "lo95"), i),
                               100 * number_in(list_of(shares, "hi95"), i)});
    const Json& by_step = list_of(method, "by_step");
    for (std::size_t step = 1; step < by_step.size(); ++step)
      falling.points.push_back({static_cast<double>(step), number_in(by_step, step)});
    profile.series.push_back(std::move(spread));
    progress.series.push_back(std::move(falling));
  }
  if (profile.series.empty()) return {};
  const std::string protocol = text_of(entry, "protocol");
  profile.title = progress.title = "all scenes and noise levels, " + protocol;
  profile.x = {"normalised error", false, false, {}, 0, 1};
  profile.y = {"instances at or below, %", false, false, {}, 0, 100};
  progress.x = {"images", true, true, {}};
  progress.y = {"mean normalised error", false, false, {}, 0, 1};
  profile.height = progress.height = std::max(300.0, 90 + 12.0 * static_cast<double>(profile.series.size()));
  const std::string file = std::to_string(index + 1) + "-" + figure_file_name(protocol);
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
