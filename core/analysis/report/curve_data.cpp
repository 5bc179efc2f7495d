// The data of the interactive curves, thinned in stages until it fits the page, least important parts first. curves.csv
// has all of it.
#include <algorithm>
#include <cmath>
#include <set>

#include "base/json_members.h"
#include "report/figures.h"
#include "report/page_data.h"
#include "report/sections.h"
#include "statistics/rules.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxCurveBytes = 2'400'000;
constexpr std::size_t kFewSteps = 16;

// Limits of one stage.
struct Thinning {
  std::size_t most_steps;
  std::size_t most_tracks;
  int digits;
  bool quartiles;
};
constexpr Thinning kThinnings[] = {{static_cast<std::size_t>(-1), 9, 5, true},
                                   {static_cast<std::size_t>(-1), 3, 4, true},
                                   {kFewSteps, 3, 4, true},
                                   {kFewSteps, 1, 4, true},
                                   {kFewSteps, 1, 3, false}};
constexpr const char* kTracks[] = {"recommended", "commanded",        "measured",           "best",
                                   "excess",      "recommended_best", "recommended_current"};  // most important first

// Indices into a curve: all, or those with bands, or evenly spaced on a logarithmic axis.
std::vector<std::size_t> kept_places(const Json& curve, std::size_t count, std::size_t most) {
  std::set<std::size_t> places;
  if (count <= most) {
    for (std::size_t i = 0; i < count; ++i) places.insert(i);
    return {places.begin(), places.end()};
  }
  for (const auto& [name, track] : object_of(curve, "tracks").items())
    for (std::size_t i = 0; i < list_of(track, "lo95").size(); ++i)
      if (track["lo95"][i].is_number()) places.insert(i);
  if (places.size() < 2 || places.size() > most) {
    places.clear();
    for (std::size_t k = 0; k < most; ++k)
      places.insert(static_cast<std::size_t>(std::lround(
          std::pow(static_cast<double>(count), static_cast<double>(k) / static_cast<double>(most - 1)) - 1)));
  }
  places.insert(0);
  places.insert(count - 1);
  return {places.begin(), places.end()};
}

Json values_at(const Json& list, const std::vector<std::size_t>& places, int digits) {
  Json values = Json::array();
  for (const std::size_t place : places)
    values.push_back(place < list.size() && list[place].is_number() ? Json(rounded(list[place].get<double>(), digits))
                                                                    : Json());
  return values;
}

Json thinned(const Json& curve, const Thinning& thinning, const std::string& first_track) {
  const Json& tracks = object_of(curve, "tracks");
  std::size_t count = 0;
  for (const auto& [name, track] : tracks.items()) count = std::max(count, list_of(track, "median").size());
  const std::vector<std::size_t> places = kept_places(curve, count, thinning.most_steps);
  Json kept = {{"method", curve["method"]}, {"trials", curve["trials"]}, {"tracks", Json::object()}};
  const std::uint64_t first = count_of(curve, "first_step");
  if (places.size() == count) {
    kept["first_step"] = first;
  } else {
    kept["steps"] = Json::array();
    for (const std::size_t place : places) kept["steps"].push_back(first + place);
  }
  std::vector<std::string> names(std::begin(kTracks), std::end(kTracks));
  std::stable_partition(names.begin(), names.end(), [&](const std::string& name) { return name == first_track; });
  for (const std::string& name : names) {
    if (!tracks.contains(name) || kept["tracks"].size() >= thinning.most_tracks) continue;
    const Json& track = tracks[name];
    Json& values = kept["tracks"][name];
    const bool has_bands = !list_of(track, "lo95").empty();
    for (const char* key : {"median", "q25", "q75", "lo95", "hi95"}) {
      const bool quartile = key[0] == 'q';
      if (list_of(track, key).empty() || (quartile && has_bands && !thinning.quartiles)) continue;
      values[key] = values_at(track[key], places, thinning.digits);
    }
  }
  for (const char* clock : {"machine_seconds", "algorithm_seconds"})
    if (!list_of(curve, clock).empty()) kept[clock] = values_at(curve[clock], places, 4);
  return kept;
}

}  // namespace

Json curve_data(const Json& data) {
  Json methods = Json::array();
  const std::map<std::string, int> styles = method_styles(data);
  for (const Json& method : data["methods"]) {
    const auto style = styles.find(style_key(text_of(method, "name"), text_of(method, "protocol")));
    if (style == styles.end()) continue;
    methods.push_back({{"name", method["name"]}, {"oracle", flag_of(method, "oracle")}, {"style", style->second}});
    if (method["label"] == method["name"]) continue;  // the name is unique
    methods.back()["label"] = method["label"];
    methods.back()["protocol"] = method["protocol"];
  }
  const statistics::Rule rule = statistics::rule_named(text_of(data, "rule")).value_or(statistics::Rule::own);
  const std::string first_track = statistics::track_name(statistics::track_of(rule));
  Json result = {{"methods", methods}, {"groups", Json::array()}, {"track", first_track}};
  for (const Thinning& thinning : kThinnings) {
    result["groups"] = Json::array();
    for (const Json& group : data["groups"]) {
      Json entry = {{"label", group["label"]}, {"protocol", group["protocol"]}, {"curves", Json::array()}};
      if (group.contains("spec_rmse")) entry["spec"] = group["spec_rmse"];
      if (!object_of(group, "floor").empty()) entry["floor"] = group["floor"];
      for (const Json& curve : group["curves"]) entry["curves"].push_back(thinned(curve, thinning, first_track));
      result["groups"].push_back(std::move(entry));
    }
    if (result.dump().size() <= kMaxCurveBytes) break;
  }
  return result;
}

}  // namespace relign::report
