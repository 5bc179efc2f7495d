// The data of the interactive curves, thinned in stages until it fits the page, least important parts first. curves.csv
// has all of it.
#include <algorithm>
#include <cmath>
#include <set>

#include "report/figures.h"
#include "report/sections.h"

namespace relign::report {
namespace {

constexpr std::size_t kMaxCurveBytes = 2'400'000;
constexpr std::size_t kFewSteps = 16;

constexpr int kDigits = 3;  // as the page shows them

// Limits of one stage.
struct Thinning {
  std::size_t most_steps;
  std::size_t most_tracks;
  bool quartiles;
};
constexpr Thinning kThinnings[] = {{static_cast<std::size_t>(-1), 9, true},
                                   {static_cast<std::size_t>(-1), 3, true},
                                   {kFewSteps, 3, true},
                                   {kFewSteps, 1, true},
                                   {kFewSteps, 1, false}};
using statistics::Track;
// Most important first.
constexpr Track kByImportance[] = {Track::recommended, Track::commanded,        Track::measured,           Track::best,
                                   Track::excess,      Track::recommended_best, Track::recommended_current};

// Indices into a curve: all, or those with bands, or evenly spaced on a logarithmic axis.
std::vector<std::size_t> kept_places(const Curve& curve, std::size_t count, std::size_t most) {
  std::set<std::size_t> places;
  if (count <= most) {
    for (std::size_t i = 0; i < count; ++i) places.insert(i);
    return {places.begin(), places.end()};
  }
  for (const CurveTrack& track : curve.tracks)
    for (std::size_t i = 0; i < track.low.size(); ++i)
      if (std::isfinite(track.low[i])) places.insert(i);
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

Json values_at(const std::vector<double>& list, const std::vector<std::size_t>& places) {
  Json values = Json::array();
  for (const std::size_t place : places)
    values.push_back(place < list.size() && std::isfinite(list[place]) ? Json(rounded(list[place], kDigits)) : Json());
  return values;
}

Json thinned(const CurveTrack& track, const std::vector<std::size_t>& places,
             const std::vector<std::size_t>& with_intervals, const Thinning& thinning) {
  Json values;
  const auto put_at = [&](const char* name, const std::vector<double>& list, const std::vector<std::size_t>& at) {
    values[name] = values_at(list, at);
  };
  const auto put = [&](const char* name, const std::vector<double>& list) { put_at(name, list, places); };
  put("median", track.median);
  if (track.low.empty() || thinning.quartiles) {
    put("q25", track.q25);
    put("q75", track.q75);
  }
  if (track.low.empty()) return values;
  // At the steps with intervals of any track only.
  put_at("lo95", track.low, with_intervals);
  put_at("hi95", track.high, with_intervals);
  return values;
}

Json thinned(const Curve& curve, const Thinning& thinning, Track first_track) {
  std::size_t count = 0;
  for (const CurveTrack& track : curve.tracks) count = std::max(count, track.median.size());
  const std::vector<std::size_t> places = kept_places(curve, count, thinning.most_steps);
  Json kept = {{"method", curve.method}, {"trials", curve.trials}, {"tracks", Json::object()}};
  if (places.size() == count) {
    kept["first_step"] = curve.first_step;
  } else {
    kept["steps"] = Json::array();
    for (const std::size_t place : places) kept["steps"].push_back(curve.first_step + place);
  }
  std::vector<std::size_t> with_intervals;
  for (std::size_t k = 0; k < places.size(); ++k)
    if (std::any_of(curve.tracks.begin(), curve.tracks.end(), [&](const CurveTrack& track) {
          return places[k] < track.low.size() && std::isfinite(track.low[places[k]]);
        })) {
      with_intervals.push_back(places[k]);
      kept["at"].push_back(k);
    }
  std::vector<Track> order(std::begin(kByImportance), std::end(kByImportance));
  std::stable_partition(order.begin(), order.end(), [&](Track track) { return track == first_track; });
  Json& tracks = kept["tracks"];
  for (const Track track : order) {
    if (curve.track(track).median.empty() || tracks.size() >= thinning.most_tracks) continue;
    Json values = thinned(curve.track(track), places, with_intervals, thinning);
    // Equal ones once, the others by name: without a cure shift the current pose is the commanded one.
    for (const auto& [name, other] : tracks.items())
      if (other == values) {
        values = name;
        break;
      }
    tracks[statistics::track_name(track)] = std::move(values);
  }
  if (!curve.machine_seconds.empty()) kept["machine_seconds"] = values_at(curve.machine_seconds, places);
  if (!curve.algorithm_seconds.empty()) kept["algorithm_seconds"] = values_at(curve.algorithm_seconds, places);
  return kept;
}

}  // namespace

Json curve_data(const PageModel& page) {
  Json methods = Json::array();
  const std::map<std::string, int> styles = method_styles(page);
  for (const Method& method : page.methods) {
    const auto style = styles.find(style_key(method.name, method.protocol));
    if (style == styles.end()) continue;
    methods.push_back(
        {{"name", method.name}, {"oracle", method.of_class == ObservationClass::oracle}, {"style", style->second}});
    if (method.label == method.name) continue;  // the name is unique
    methods.back()["label"] = method.label;
    methods.back()["protocol"] = method.protocol;
  }
  const Track first_track = statistics::track_of(page.rule);
  Json result = {{"methods", methods}, {"groups", Json::array()}, {"track", statistics::track_name(first_track)}};
  for (const Thinning& thinning : kThinnings) {
    result["groups"] = Json::array();
    for (const Group& group : page.groups) {
      Json entry = {{"label", group.label}, {"protocol", group.protocol}, {"curves", Json::array()}};
      if (std::isfinite(group.spec.score)) entry["spec"] = group.spec.score;
      if (!group.scored_by.squared) entry["score"] = group.scored_by.label();
      if (group.words.counted != SceneWords().counted) entry["counted"] = group.words.counted;
      if (!group.scored_by.logarithmic) entry["linear"] = true;
      if (std::isfinite(group.own_optimum)) entry["floor"]["own_optimum"] = group.own_optimum;
      if (std::isfinite(group.next_image)) entry["floor"]["next_image"] = group.next_image;
      for (const Curve& curve : group.curves) entry["curves"].push_back(thinned(curve, thinning, first_track));
      result["groups"].push_back(std::move(entry));
    }
    if (result.dump().size() <= kMaxCurveBytes) break;
  }
  return result;
}

}  // namespace relign::report
