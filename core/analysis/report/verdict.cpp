#include "report/verdict.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "base/json_members.h"
#include "base/text.h"
#include "report/page_data.h"
#include "report/page_groups.h"
#include "report/spec_words.h"
#include "report/verdict_cases.h"

namespace relign::report {
namespace {

constexpr int kDigits = 3;
constexpr std::uint64_t kFewInstances = 60;

std::string shown(const Json& number) { return number.is_number() ? significant(number.get<double>(), kDigits) : "-"; }

std::string counted(std::uint64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

bool has_interval(const Json& score) { return score.contains("lo95") && score["lo95"].is_number(); }

// "0.0110 (95 %: 0.0090 to 0.0130) over 60 instances", or with quartiles where there is no interval.
std::string median_words(const Json& score) {
  const std::uint64_t n = score["n"].get<std::uint64_t>();
  if (n == 1) return shown(score["median"]) + " on its only instance";
  const std::string spread = has_interval(score)
                                 ? " (95 %: " + shown(score["lo95"]) + " to " + shown(score["hi95"]) + ")"
                                 : " (quartiles " + shown(score["q25"]) + " to " + shown(score["q75"]) + ")";
  return shown(score["median"]) + spread + " over " + counted(n, "instance");
}

// How the first compares with the second on the same lenses; empty when nobody could tell.
std::string comparison(const Json& group, const std::string& first, const std::string& second, double relevant) {
  for (const Json& pair : list_of(group, "pairs")) {
    const bool other_way = text_of(pair, "a") == second && text_of(pair, "b") == first;
    if (!other_way && !(text_of(pair, "a") == first && text_of(pair, "b") == second)) continue;
    if (!pair["ratio"].is_number()) return "";
    return verdict_sentence(other_way ? turned(pair) : pair, second, relevant);
  }
  return "";
}

// How many lenses came into specification, how fast.
std::string yield_words(const Json& group, const Json& row) {
  const Json& yield = object_of(row, "yield");
  const Json& arrival = object_of(row, "to_spec");
  const std::string spec = spec_words(group);
  if (yield.empty() || spec.empty()) return "";
  const auto percent = [](const Json& share) {
    return share.is_number() ? std::to_string(static_cast<int>(std::lround(100 * share.get<double>())))
                             : std::string("-");
  };
  std::string text =
      "It brings " + std::to_string(count_of(yield, "in")) + " of " + counted(count_of(yield, "n"), "lens");
  if (text.back() == 's' && count_of(yield, "n") != 1) text.replace(text.size() - 1, 1, "es");
  text +=
      " (95 %: " + percent(yield["lo95"]) + " to " + percent(yield["hi95"]) + " %) into specification (" + spec + ")";
  const Json& steps = arrival.value("steps", Json());
  if (steps.is_number()) {
    // Who got there and left again, or whom the glue moved out, is told apart: 13 in the end are not half of all.
    if (const std::uint64_t once = count_of(arrival, "successes"); once > count_of(yield, "in"))
      text += "; " + std::to_string(once) + " would have been in it after some step";
    text += std::string(judges_mtf(group) ? ", by their RMSE" : ",") + " half of all within " +
            counted(static_cast<std::uint64_t>(std::ceil(steps.get<double>())), "step") +
            (arrival["seconds"].is_number() ? " and " + shown(arrival["seconds"]) + " s of machine time" : "");
  }
  if (const Json& uncured = object_of(yield, "uncured"); !uncured.empty())
    text += "; before the glue cures it is " + std::to_string(count_of(uncured, "in")) + " of " +
            std::to_string(count_of(uncured, "n"));
  return text + ". ";
}

// Rows with a median, oracles apart: who is told the answer cannot win. Of one class alone, or of all.
struct Ranked {
  explicit Ranked(const Json& group, const std::string& of_class = "") {
    for (const Json& row : group["rows"]) {
      if (score_of(row)["n"] == 0 || !(of_class.empty() || text_of(row, "class") == of_class)) continue;
      (flag_of(row, "oracle") ? oracles : methods).push_back(&row);
    }
  }
  std::vector<const Json*> methods, oracles;
};

double yield_of(const Json& row) {
  const Json& share = object_of(row, "yield").value("share", Json());
  return share.is_number() ? share.get<double>() : -1;
}

// Who wants good lenses does not ask for the lowest median.
std::string highest_yield_words(const Ranked& ranked) {
  const Json* most = ranked.methods.front();
  for (const Json* row : ranked.methods)
    if (yield_of(*row) > yield_of(*most)) most = row;
  if (most == ranked.methods.front()) return "";
  const Json& yield = object_of(*most, "yield");
  return "Most into specification brings " + text_of(*most, "method") + ": " + std::to_string(count_of(yield, "in")) +
         " of " + std::to_string(count_of(yield, "n")) + ". ";
}

std::string failures_of(const Json& row) {
  const std::uint64_t failed = count_of(row, "failed");
  if (failed == 0) return "";
  return " (" + std::to_string(failed) + " of its " + std::to_string(failed + count_of(row, "trials")) +
         " trials failed and do not count in this median)";
}

std::string oracle_words(const Ranked& ranked) {
  std::string text;
  for (const Json* oracle : ranked.oracles)
    text += text_of(*oracle, "method") + ", which is told the design pose, reaches " +
            shown(score_of(*oracle)["median"]) + ". ";
  return text;
}

std::string measured_only_words(const Json& group) {
  if (!flag_of(group, "measured_only")) return "";
  return flag_of(group, "station") ? "Measured only: a station tells no truth. "
                                   : "Measured only: this scene tells no truth. ";
}

// Of a class, or of all where there is one class: `whole` adds what is of the group.
std::string sentence(const Json& group, const Ranked& ranked, double relevant, bool whole) {
  if (ranked.methods.empty()) {
    if (!ranked.oracles.empty()) return "only an oracle has finished; nothing can be ranked.";
    const bool any_trial = std::any_of(group["rows"].begin(), group["rows"].end(),
                                       [](const Json& row) { return count_of(row, "trials") > 0; });
    return any_trial ? "no error was recorded, neither measured nor noise-free; nothing can be ranked."
                     : "every trial failed; nothing can be ranked.";
  }
  const Json& best = *ranked.methods.front();
  const Json& score = score_of(best);
  const bool measured_only = flag_of(group, "measured_only");
  const std::string error = measured_only ? "measured error" : "error";
  std::string text = text_of(best, "method") + " ends with the lowest ";
  text += (score["n"] == 1 ? error : "median " + error) + ", " + median_words(score);
  text += failures_of(best);
  if (whole && group["start"].is_number()) text += "; at the start it was " + shown(group["start"]);
  text += ". " + yield_words(group, best) + highest_yield_words(ranked);
  if (ranked.methods.size() > 1) {
    const Json& next = *ranked.methods[1];
    const bool level = shown(score_of(next)["median"]) == shown(score["median"]);
    text += level ? text_of(next, "method") + " ends level with it"
                  : "Next is " + text_of(next, "method") + " with " + shown(score_of(next)["median"]);
    text += failures_of(next) + ". ";
    const std::string words = comparison(group, text_of(best, "method"), text_of(next, "method"), relevant);
    if (!words.empty()) text += words + ". ";
  } else {
    text += whole ? "No other method has a result here. " : "No other method of this class has a result here. ";
  }
  if (whole) text += oracle_words(ranked) + measured_only_words(group);
  text.pop_back();
  return text;
}

// " (instances 3, 17)"
std::string hopeless_words(const Json& group) {
  constexpr std::size_t kMostNamed = 10;
  std::vector<std::string> names;
  for (const Json& instance : list_of(group, "hopeless"))
    if (names.size() < kMostNamed && instance.is_number()) names.push_back(instance.dump());
  if (names.empty()) return "";
  return std::string(names.size() == 1 ? " (instance " : " (instances ") + join(names, ", ") +
         (list_of(group, "hopeless").size() > kMostNamed ? ", ..." : "") + ")";
}

double relevant_ratio(const Json& data) {
  const Json& ratio = data.value("smallest_relevant_ratio", Json());
  return ratio.is_number() ? ratio.get<double>() : 1;
}

}  // namespace

Json verdict(const Json& data) {
  Json list = Json::array();
  const double relevant = relevant_ratio(data);
  for (const Json& group : data["groups"]) {
    const Ranked ranked(group);
    Json entry = {{"label", group["label"]},
                  {"best", ranked.methods.empty() ? "" : text_of(*ranked.methods.front(), "method")}};
    std::vector<std::pair<std::string, Ranked>> classes;
    for (const char* name : kClasses)
      if (Ranked of_class(group, name); !of_class.methods.empty()) classes.emplace_back(name, std::move(of_class));
    if (classes.size() < 2) {
      entry["text"] = sentence(group, ranked, relevant, true);
      list.push_back(std::move(entry));
      continue;
    }
    // One ranking across privileges would be read as one of methods.
    std::string text;
    entry["classes"] = Json::array();
    for (const auto& [name, of_class] : classes) {
      const std::string words = sentence(group, of_class, relevant, false);
      const std::string best = text_of(*of_class.methods.front(), "method");
      entry["classes"].push_back({{"class", name}, {"title", class_title(name)}, {"best", best}, {"text", words}});
      text += class_title(name) + ": " + words + " ";
    }
    std::string rest = oracle_words(ranked) + measured_only_words(group);
    if (group["start"].is_number()) rest = "At the start the median error was " + shown(group["start"]) + ". " + rest;
    text += rest;
    if (!rest.empty()) entry["rest"] = rest.substr(0, rest.size() - 1);
    entry["text"] = text.substr(0, text.size() - 1);
    list.push_back(std::move(entry));
  }
  return list;
}

std::string computing_time_note(const Json& data) {
  constexpr double kMostHarness = 0.05;           // of the time that the scene takes
  constexpr double kFewHarnessMicroseconds = 50;  // a step: no scene is fast enough for it to matter
  const Json& harness = object_of(data["ran"], "harness");
  const Json& share = member(harness, "share_of_scene_time");
  if (!share.is_number() || share.get<double>() <= kMostHarness ||
      harness["microseconds_per_step"].get<double>() <= kFewHarnessMicroseconds)
    return "";
  return "Between scene and algorithm " + significant(100 * share.get<double>(), 2) +
         " % of the scene's time went by, on a busy machine mostly in waiting for a core: do not compare computing "
         "times from here. Errors and images are not concerned.";
}

Json beware(const Json& data) {
  Json list = Json::array();
  const Json& ran = data["ran"];
  const std::uint64_t failed = count_of(ran, "failed"), missing = count_of(ran, "missing");
  if (missing > 0)
    list.push_back(counted(missing, "trial") + " of " + std::to_string(count_of(ran, "planned")) +
                   " not finished: this is a partial result, and every number below may still move.");
  if (failed > 0)
    list.push_back(counted(failed, "trial") +
                   " failed. Failed trials are left out of medians and curves, which flatters " +
                   "a method that fails on hard instances; their number stands in the table.");

  std::set<std::string> oracles;
  bool home_told_start = false, uneven = false, uneven_steps = false, station = false, measured_only = false;
  std::uint64_t fewest = 0;
  for (const Json& group : data["groups"]) {
    uneven = uneven || !flag_of(group, "same_instances");
    station = station || flag_of(group, "station");
    measured_only = measured_only || flag_of(group, "measured_only");
    const std::uint64_t instances = count_of(group, "instances");
    fewest = fewest == 0 ? instances : std::min(fewest, instances);
    for (const Json& row : group["rows"]) {
      if (flag_of(row, "oracle"))
        oracles.insert(label_of(data["methods"], text_of(row, "method"), text_of(group, "protocol")));
      if (!flag_of(row, "oracle") && text_of(row, "method") == "home") home_told_start = true;
      if (row["step"] != group["rows"].front()["step"]) uneven_steps = true;
    }
  }
  if (std::string note = computing_time_note(data); !note.empty()) list.push_back(std::move(note));
  if (uneven)
    list.push_back("Not every method has finished the same instances, so some medians are over different lenses.");
  if (uneven_steps) list.push_back("Methods were given different numbers of steps; see the column 'after step'.");
  for (const std::string& oracle : oracles)
    list.push_back(oracle + " is an oracle: it is told the design pose, which no method may know under the blind " +
                   "protocol. It shows what that knowledge is worth and is not ranked.");
  if (measured_only)
    list.push_back(
        "Where it says measured only, the error is the lowest RMSE that the camera saw, its noise included: the best "
        "of "
        "many looks, which flatters a method that looks often. Unknown are the true poses, the error without noise, "
        "and "
        "what gluing at the recommended pose would give.");
  if (station)
    list.push_back(
        "A station's trials cannot be replayed: its lenses, start and stage are its own and differ from trial to trial "
        "in ways that nobody knows. home, which must be told the true start, is left out there.");
  if (home_told_start)
    list.push_back(
        "home only moves once, to the nominal pose, which it may know under the paper protocol: nearly the " +
        std::string("answer where lenses and stage are nearly perfect, worthless where they are not."));
  if (count_of(ran, "finished") > 0) {
    const bool intervals = std::any_of(data["groups"].begin(), data["groups"].end(), [](const Json& group) {
      return std::any_of(group["rows"].begin(), group["rows"].end(),
                         [](const Json& row) { return has_interval(score_of(row)); });
    });
    if (fewest == 1)
      list.push_back("A single instance says how one lens went, nothing about the next one.");
    else if (!intervals)
      list.push_back("Brackets are quartiles (the middle half of the instances), not confidence intervals.");
    else
      list.push_back(
          "95 % intervals are by the bootstrap over instances. Better means that the whole interval lies beyond the "
          "factor " +
          significant(relevant_ratio(data), 3) + " that counts as relevant" +
          (fewest < kFewInstances ? "; " + std::to_string(fewest) + " instances are few, and the intervals wide."
                                  : "."));
    for (const Json& group : data["groups"])
      if (const std::uint64_t hopeless = count_of(group, "cannot_meet_spec"); hopeless > 0)
        list.push_back(
            text_of(group, "label") + ": " + std::to_string(hopeless) + (hopeless == 1 ? " lens" : " lenses") +
            (judges_mtf(group) ? " met the specification neither at its own best pose nor where any method left it"
                               : " cannot meet the specification at any pose") +
            hopeless_words(group) + ".");
  }
  return list;
}

}  // namespace relign::report
