#include "report/aggregate_data.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/json_members.h"
#include "report/page_data.h"

namespace relign::report {
namespace {

void put(Json& object, const std::string& name, const statistics::Band& band) {
  object[name] = shown_number(band.estimate);
  object[name + "_lo95"] = shown_number(band.interval.low);
  object[name + "_hi95"] = shown_number(band.interval.high);
}

void put_bands(Json& object, const statistics::AggregateBands& bands) {
  object["n"] = bands.iqm.n;
  put(object, "iqm", bands.iqm);
  put(object, "median", bands.median);
  put(object, "gap", bands.gap);
  put(object, "area", bands.area);
}

Json list_json(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(shown_number(value));
  return list;
}

Json profile_json(const std::vector<statistics::Band>& profile) {
  Json share = Json::array(), low = Json::array(), high = Json::array();
  for (const statistics::Band& band : profile) {
    share.push_back(shown_number(band.estimate));
    low.push_back(shown_number(band.interval.low));
    high.push_back(shown_number(band.interval.high));
  }
  return {{"share", std::move(share)}, {"lo95", std::move(low)}, {"hi95", std::move(high)}};
}

// Variation between the trainings of a method.
Json spread_json(const std::vector<statistics::AggregateMethod>& members) {
  double lowest = INFINITY, highest = -INFINITY, sum = 0, squares = 0;
  for (const statistics::AggregateMethod& member : members) {
    const double iqm = member.bands.iqm.estimate;
    lowest = std::min(lowest, iqm);
    highest = std::max(highest, iqm);
    sum += iqm;
  }
  const auto count = static_cast<double>(members.size());
  for (const statistics::AggregateMethod& member : members)
    squares += (member.bands.iqm.estimate - sum / count) * (member.bands.iqm.estimate - sum / count);
  return {{"lowest", shown_number(lowest)},
          {"highest", shown_number(highest)},
          {"sd", shown_number(std::sqrt(squares / (count - 1)))}};
}

Json method_json(const statistics::AggregateMethod& method, const std::string& of_class, const std::string& tag) {
  Json json = {{"method", method.name},   {"class", of_class},       {"oracle", of_class == "oracle"},
               {"strata", method.strata}, {"failed", method.failed}, {"steps", method.steps}};
  if (!tag.empty()) json["training_tag"] = tag;
  if (method.bands.iqm.n == 0) return json;
  put_bands(json, method.bands);
  json["profile"] = profile_json(method.bands.profile);
  json["by_step"] = list_json(method.by_step);
  if (method.members.empty()) return json;
  json["trainings"] = Json::array();
  for (const statistics::AggregateMethod& member : method.members) {
    Json training = {{"training", member.name}, {"failed", member.failed}};
    put_bands(training, member.bands);
    json["trainings"].push_back(std::move(training));
  }
  if (method.members.size() > 1) json["spread"] = spread_json(method.members);
  return json;
}

// Training tags by display name, and by the name of a method with several trainings.
std::map<std::string, std::string> tags_of(const Json& manifest) {
  std::map<std::string, std::set<std::string>> trainings;  // sets: a method may run under both protocols
  for (const Json& entry : list_of(manifest, "algorithms"))
    if (const Json& list = object_of(entry, "of_list"); !list.empty())
      trainings[text_of(list, "method")].insert(text_of(list, "training"));
  std::map<std::string, std::string> tags;
  for (const Json& entry : list_of(manifest, "algorithms")) {
    const Json& list = object_of(entry, "of_list");
    const std::string name = text_of(entry, "name"), method = text_of(list, "method");
    const std::size_t count = list.empty() ? 0 : trainings[method].size();
    if (count > 1) {
      tags[name] = "1 of " + std::to_string(count) + " trainings";
      tags[method] = std::to_string(count) + " trainings";
    } else if (count == 1 || !object_of(entry, "training").empty()) {
      tags[name] = kOneTraining;
      if (count == 1) tags[method] = kOneTraining;
    }
  }
  return tags;
}

}  // namespace

void add_aggregate(Json& data, const LoadedResults& results, const statistics::Study& study) {
  const std::map<std::string, std::string> tags = tags_of(results.manifest);
  const auto tag_of = [&tags](const std::string& name) {
    const auto found = tags.find(name);
    return found == tags.end() ? std::string() : found->second;
  };
  std::map<std::string, std::string> lists;  // from display name to method with several trainings
  for (const Json& entry : list_of(results.manifest, "algorithms"))
    if (const Json& list = object_of(entry, "of_list"); !list.empty())
      lists[text_of(entry, "name")] = text_of(list, "method");
  std::map<std::pair<std::string, std::string>, std::string> classes;  // by method and protocol
  for (Json& method : data["methods"]) {
    const std::string name = text_of(method, "name"), protocol = text_of(method, "protocol");
    classes[{lists.count(name) ? lists[name] : name, protocol}] = text_of(method, "class");
    if (const std::string tag = tag_of(name); !tag.empty()) method["training_tag"] = tag;
  }
  for (Json& group : data["groups"])
    for (Json& row : group["rows"])
      if (const std::string tag = tag_of(text_of(row, "method")); !tag.empty()) row["training_tag"] = tag;

  Json all = Json::array();
  for (const statistics::AggregateStudy& one : study.aggregates) {
    Json entry = {{"protocol", one.protocol}, {"resolution", statistics::kResolution},
                  {"strata", Json::array()},  {"methods", Json::array()},
                  {"pairs", Json::array()},   {"profile_places", list_json(statistics::profile_places())}};
    for (const std::size_t group : one.strata) {
      const statistics::GroupStudy& stratum = study.groups[group];
      entry["strata"].push_back(
          {{"scene", stratum.scene}, {"noise_level", stratum.noise_level}, {"instances", stratum.instances.size()}});
    }
    for (const statistics::AggregateMethod& method : one.methods)
      entry["methods"].push_back(method_json(method, classes[{method.name, one.protocol}], tag_of(method.name)));
    for (const statistics::Improvement& pair : one.pairs)
      entry["pairs"].push_back({{"a", one.methods[pair.first].name},
                                {"b", one.methods[pair.second].name},
                                {"n", pair.share.n},
                                {"improvement", shown_number(pair.share.estimate)},
                                {"lo95", shown_number(pair.share.interval.low)},
                                {"hi95", shown_number(pair.share.interval.high)}});
    all.push_back(std::move(entry));
  }
  if (!all.empty()) data["aggregate"] = std::move(all);
}

std::string training_tag(const Json& data, const std::string& method) {
  for (const Json& entry : data["methods"])
    if (text_of(entry, "name") == method) return text_of(entry, "training_tag");
  return "";
}

}  // namespace relign::report
