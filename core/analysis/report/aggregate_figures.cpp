// The figures of the aggregates: how errors are spread over the instances, and how they fall with the images.
#include <algorithm>
#include <limits>

#include "base/json_members.h"
#include "report/figures.h"

namespace relign::report {
namespace {

double number(const Json& list, std::size_t at) {
  return list.is_array() && at < list.size() && list[at].is_number() ? list[at].get<double>()
                                                                     : std::numeric_limits<double>::quiet_NaN();
}

// A list of trainings looks like the first of them, which has a curve of its own elsewhere.
int style_of(const Json& data, const std::map<std::string, int>& styles, const Json& method) {
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
    const int style = style_of(data, styles, method);
    const Json &places = list_of(entry, "profile_places"), &shares = object_of(method, "profile");
    ChartSeries spread = {name, style, Drawn::line, {}}, falling = {name, style, Drawn::steps, {}};
    for (std::size_t i = 0; i < places.size(); ++i)
      spread.points.push_back({number(places, i), 100 * number(list_of(shares, "share"), i),
                               100 * number(list_of(shares, "lo95"), i), 100 * number(list_of(shares, "hi95"), i)});
    const Json& by_step = list_of(method, "by_step");
    for (std::size_t step = 1; step < by_step.size(); ++step)
      falling.points.push_back({static_cast<double>(step), number(by_step, step)});
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
  return {{"profile-" + file,
           "Performance profile: how many instances end at or below a normalised error. Higher and further left is "
           "better; bands are 95 % intervals.",
           profile},
          {"progress-" + file,
           "How fast: mean normalised error after so many images. What lies under a line, averaged over the images, is "
           "the error-curve area of the table.",
           progress}};
}

}  // namespace relign::report
