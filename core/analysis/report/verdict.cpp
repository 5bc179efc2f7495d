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
#include "report/sections.h"
#include "report/spec_words.h"
#include "report/verdict_cases.h"

namespace relign::report {
namespace {

constexpr std::uint64_t kFewInstances = 60;

bool has_interval(const Json& score) { return score.contains("lo95") && score["lo95"].is_number(); }

// "0.0110 (95 % CI 0.0090 to 0.0130) over 60 instances", or with quartiles if there is no interval.
std::string median_text(const Json& score) {
  const std::uint64_t n = score["n"].get<std::uint64_t>();
  if (n == 1) return number_or_dash(score["median"]) + " on a single instance";
  const std::string spread =
      has_interval(score) ? " (95 % CI " + number_or_dash(score["lo95"]) + " to " + number_or_dash(score["hi95"]) + ")"
                          : " (quartiles " + number_or_dash(score["q25"]) + " to " + number_or_dash(score["q75"]) + ")";
  return number_or_dash(score["median"]) + spread + " over " + counted(n, "instance");
}

// The paired comparison of first and second as a sentence; empty without one.
std::string comparison(const Json& group, const std::string& first, const std::string& second, double relevant) {
  for (const Json& pair : list_of(group, "pairs")) {
    const bool other_way = text_of(pair, "a") == second && text_of(pair, "b") == first;
    if (!other_way && !(text_of(pair, "a") == first && text_of(pair, "b") == second)) continue;
    if (!pair["ratio"].is_number()) return "";
    return verdict_sentence(other_way ? turned(pair) : pair, relevant);
  }
  return "";
}

// Yield and time to specification.
std::string yield_text(const Json& group, const Json& row) {
  const Json& yield = object_of(row, "yield");
  const Json& arrival = object_of(row, "to_spec");
  const std::string spec = spec_words(group);
  if (yield.empty() || spec.empty()) return "";
  const auto percent = [](const Json& share) {
    return share.is_number() ? std::to_string(static_cast<int>(std::lround(100 * share.get<double>())))
                             : std::string("-");
  };
  std::string text = "Yield: " + std::to_string(count_of(yield, "in")) + " of " +
                     counted(count_of(yield, "n"), "instance") + " (95 % CI " + percent(yield["lo95"]) + " to " +
                     percent(yield["hi95"]) + " %) meet the specification (" + spec + ")";
  const Json& steps = arrival.value("steps", Json());
  if (steps.is_number()) {
    // More instances may meet the specification at some step than at the end, so that the median time is below the
    // budget although the yield is under one half.
    if (const std::uint64_t once = count_of(arrival, "successes"); once > count_of(yield, "in"))
      text += "; " + std::to_string(once) + " met it at some step";
    text += std::string(", half of all instances") + (judges_mtf(group) ? " by RMSE" : "") + " within " +
            counted(static_cast<std::uint64_t>(std::ceil(steps.get<double>())), "step") +
            (arrival["seconds"].is_number() ? " and " + number_or_dash(arrival["seconds"]) + " s of machine time" : "");
  }
  if (const Json& uncured = object_of(yield, "uncured"); !uncured.empty())
    text +=
        "; before curing " + std::to_string(count_of(uncured, "in")) + " of " + std::to_string(count_of(uncured, "n"));
  return text + ". ";
}

// Rows with a result, oracles apart since they are not ranked. Of one observation class, or of all.
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

// The method with the highest yield, if it is not the one with the lowest median.
std::string highest_yield_text(const Ranked& ranked) {
  const Json* most = ranked.methods.front();
  for (const Json* row : ranked.methods)
    if (yield_of(*row) > yield_of(*most)) most = row;
  if (most == ranked.methods.front()) return "";
  const Json& yield = object_of(*most, "yield");
  return "The highest yield is that of " + text_of(*most, "method") + ": " + std::to_string(count_of(yield, "in")) +
         " of " + std::to_string(count_of(yield, "n")) + ". ";
}

std::string failures_of(const Json& row) {
  const std::uint64_t failed = count_of(row, "failed");
  if (failed == 0) return "";
  return " (" + std::to_string(failed) + " of its " + std::to_string(failed + count_of(row, "trials")) +
         " trials failed, excluded from the median)";
}

std::string oracle_text(const Ranked& ranked) {
  std::string text;
  for (const Json* oracle : ranked.oracles)
    text += "The oracle " + text_of(*oracle, "method") + ", which is given the design pose, reaches " +
            number_or_dash(score_of(*oracle)["median"]) + ". ";
  return text;
}

std::string measured_only_text(const Json& group) {
  if (!flag_of(group, "measured_only")) return "";
  return flag_of(group, "station") ? "Measured only: a station has no ground truth. "
                                   : "Measured only: this scene has no ground truth. ";
}

// Of one class, or of the whole group if there is only one class: `whole` adds the texts that belong to the group.
std::string sentence(const Json& group, const Ranked& ranked, double relevant, bool whole) {
  if (ranked.methods.empty()) {
    if (!ranked.oracles.empty()) return "only oracles have results; nothing can be ranked.";
    const bool any_trial = std::any_of(group["rows"].begin(), group["rows"].end(),
                                       [](const Json& row) { return count_of(row, "trials") > 0; });
    return any_trial ? "no measured or noise-free error was recorded; nothing can be ranked."
                     : "every trial failed; nothing can be ranked.";
  }
  const Json& best = *ranked.methods.front();
  const Json& score = score_of(best);
  const bool measured_only = flag_of(group, "measured_only");
  const std::string error = measured_only ? "measured error" : "error";
  std::string text = text_of(best, "method") + " has the lowest ";
  text += (score["n"] == 1 ? error : "median " + error) + ", " + median_text(score);
  text += failures_of(best);
  if (whole && group["start"].is_number())
    text += "; the median error at the start is " + number_or_dash(group["start"]);
  text += ". " + yield_text(group, best) + highest_yield_text(ranked);
  if (ranked.methods.size() > 1) {
    const Json& next = *ranked.methods[1];
    const bool equal = number_or_dash(score_of(next)["median"]) == number_or_dash(score["median"]);
    text += "Second is " + text_of(next, "method") + " with " +
            (equal ? "the same median" : number_or_dash(score_of(next)["median"]));
    text += failures_of(next) + ". ";
    const std::string words = comparison(group, text_of(best, "method"), text_of(next, "method"), relevant);
    if (!words.empty()) text += words + ". ";
  } else {
    text += whole ? "No other method has a result. " : "No other method of this class has a result. ";
  }
  if (whole) text += oracle_text(ranked) + measured_only_text(group);
  text.pop_back();
  return text;
}

// " (instances 3, 17)"
std::string infeasible_names(const Json& group) {
  constexpr std::size_t kMaxNamed = 10;
  std::vector<std::string> names;
  for (const Json& instance : list_of(group, "infeasible"))
    if (names.size() < kMaxNamed && instance.is_number()) names.push_back(instance.dump());
  if (names.empty()) return "";
  return std::string(names.size() == 1 ? " (instance " : " (instances ") + join(names, ", ") +
         (list_of(group, "infeasible").size() > kMaxNamed ? ", ..." : "") + ")";
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
    // Methods with different observations are not comparable: one ranking per class.
    std::string text;
    entry["classes"] = Json::array();
    for (const auto& [name, of_class] : classes) {
      const std::string words = sentence(group, of_class, relevant, false);
      const std::string best = text_of(*of_class.methods.front(), "method");
      entry["classes"].push_back({{"class", name}, {"title", class_title(name)}, {"best", best}, {"text", words}});
      text += class_title(name) + ": " + words + " ";
    }
    std::string rest = oracle_text(ranked) + measured_only_text(group);
    if (group["start"].is_number())
      rest = "The median error at the start is " + number_or_dash(group["start"]) + ". " + rest;
    text += rest;
    if (!rest.empty()) entry["rest"] = rest.substr(0, rest.size() - 1);
    entry["text"] = text.substr(0, text.size() - 1);
    list.push_back(std::move(entry));
  }
  return list;
}

std::string computing_time_note(const Json& data) {
  constexpr double kMaxHarness = 0.05;            // share of the scene's time
  constexpr double kFewHarnessMicroseconds = 50;  // per step: negligible for any scene
  const Json& harness = object_of(data["ran"], "harness");
  const Json& share = member(harness, "share_of_scene_time");
  if (!share.is_number() || share.get<double>() <= kMaxHarness ||
      harness["microseconds_per_step"].get<double>() <= kFewHarnessMicroseconds)
    return "";
  return "Harness overhead was " + significant(100 * share.get<double>(), 2) +
         " % of the scene's time, on a busy machine mostly waiting for a core: do not compare compute times of this "
         "run. Errors and images are not affected.";
}

Json caveats(const Json& data) {
  Json list = Json::array();
  const Json& ran = data["ran"];
  const std::uint64_t failed = count_of(ran, "failed"), missing = count_of(ran, "missing");
  if (missing > 0)
    list.push_back("Partial results: " + std::to_string(missing) + " of " + counted(count_of(ran, "planned"), "trial") +
                   " have not finished, and all numbers below may change.");
  if (failed > 0)
    list.push_back(
        counted(failed, "trial") +
        " failed. Failed trials are excluded from medians and curves, which favours methods that fail on hard "
        "instances; the ranking lists their number.");

  std::set<std::string> oracles;
  bool home_observes_start = false, uneven = false, uneven_steps = false, station = false, measured_only = false;
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
      if (!flag_of(row, "oracle") && text_of(row, "method") == "home") home_observes_start = true;
      if (row["step"] != group["rows"].front()["step"]) uneven_steps = true;
    }
  }
  if (std::string note = computing_time_note(data); !note.empty()) list.push_back(std::move(note));
  if (uneven)
    list.push_back("Not every method has finished the same instances, so some medians are over different instances.");
  if (uneven_steps) list.push_back("Methods have different step budgets; see the column 'steps'.");
  for (const std::string& oracle : oracles)
    list.push_back(oracle + " is an oracle: it is given the design pose, which no method may observe under the blind " +
                   "protocol. It shows the value of this information and is not ranked.");
  if (measured_only)
    list.push_back(
        "Measured only: the error is the lowest measured RMSE, camera noise included. As a minimum over all images it "
        "favours methods that take many. True poses, noise-free errors and the result of fixing the lens at the "
        "recommended pose are unknown.");
  if (station)
    list.push_back(
        "Trials on a station cannot be replayed: its lenses, start poses and stage vary from trial to trial in unknown "
        "ways. home, which needs the true start pose, is left out.");
  if (home_observes_start)
    list.push_back(
        "home makes a single move to the nominal pose, which the paper protocol lets it observe: near the optimum if "
        "lens and stage are nearly perfect, far from it otherwise.");
  if (count_of(ran, "finished") > 0) {
    const bool intervals = std::any_of(data["groups"].begin(), data["groups"].end(), [](const Json& group) {
      return std::any_of(group["rows"].begin(), group["rows"].end(),
                         [](const Json& row) { return has_interval(score_of(row)); });
    });
    if (fewest == 1)
      list.push_back("Results on a single instance do not generalise to other instances.");
    else if (!intervals)
      list.push_back("Brackets are quartiles (the middle half of the instances), not confidence intervals.");
    else
      list.push_back(
          "95 % intervals (CI) are bootstrap confidence intervals over instances. 'Better' requires the whole interval "
          "of the error ratio to be beyond the smallest relevant ratio of " +
          significant(relevant_ratio(data), 3) +
          (fewest < kFewInstances ? "; with only " + std::to_string(fewest) + " instances intervals are wide." : "."));
    for (const Json& group : data["groups"])
      if (const std::uint64_t infeasible = count_of(group, "cannot_meet_spec"); infeasible > 0)
        list.push_back(
            text_of(group, "label") + ": " + counted(infeasible, "infeasible instance") + infeasible_names(group) +
            (judges_mtf(group) ? ": neither the own optimum nor the final pose of any method meets the specification."
                               : ": even the own optimum misses the specification."));
  }
  return list;
}

}  // namespace relign::report
