#include "report/verdict.h"

#include <algorithm>
#include <map>
#include <set>

#include "base/text.h"
#include "report/matrix_data.h"
#include "report/spec_words.h"
#include "report/verdict_cases.h"

namespace relign::report {
namespace {

double yield_share(const Row& row) { return row.yield ? row.yield->share : -1; }

std::string share_text(const Yield& yield) { return std::to_string(yield.in) + " of " + std::to_string(yield.n); }

// Rows with a result, oracles apart since they are not ranked. Of one observation class, or of all. By the median
// error, or by yield.
struct Ranked {
  Ranked(const Group& group, bool by_yield, std::optional<ObservationClass> of_class = std::nullopt) {
    for (const Row& row : group.rows)
      if (row.has_score() && (!of_class || row.of_class == *of_class))
        (row.oracle() ? oracles : methods).push_back(&row);
    if (by_yield)
      std::stable_sort(methods.begin(), methods.end(),
                       [](const Row* a, const Row* b) { return yield_share(*a) > yield_share(*b); });
  }
  std::vector<const Row*> methods, oracles;
};

// "0.0110 (95 % CI 0.0090 to 0.0130) over 60 instances", or with quartiles if there is no interval.
std::string median_text(const Score& score) {
  const std::string median = number_text(score.median);
  if (score.n == 1) return median + " on a single instance";
  const bool interval = score.interval.exists();
  return median + (interval ? " (95 % CI " : " (quartiles ") +
         interval_text(interval ? score.interval : statistics::Interval{score.q25, score.q75}, 3, " to ") + ") over " +
         counted(score.n, "instance");
}

std::string failures_of(const Row& row) {
  if (row.failed == 0) return "";
  return " (" + std::to_string(row.failed) + " of its " + std::to_string(row.failed + row.trials) +
         " trials failed, excluded from the median)";
}

// What a sentence may be about: a class of a group, or the whole group if it has one class only.
struct Subject {
  const Group& group;
  Ranked ranked;
  double relevant;  // smallest relevant ratio
  bool whole;
  bool by_yield;
  const Row& best() const { return *ranked.methods.front(); }
};

// Between what every error is: "median error at the start is 12.5, that of the instances' optima 0.332".
std::string around_words(const Group& group) {
  const bool start = std::isfinite(group.start), optimum = std::isfinite(group.own_optimum);
  if (!start && !optimum) return "";
  return "median error " + (start ? "at the start is " + number_text(group.start) + (optimum ? ", that " : "") : "") +
         (optimum ? "of the instances' optima " + std::string(start ? "" : "is ") +
                        excess_text(group.own_optimum, group.scored_by)
                  : "");
}

std::string lowest_error(const Subject& of) {
  const Score& score = of.best().score();
  const std::string around = of.whole ? around_words(of.group) : "";
  return of.best().method + " has the lowest " + (score.n == 1 ? "" : "median ") +
         (of.group.measured_only ? "measured error" : "error") + ", " + median_text(score) + failures_of(of.best()) +
         (around.empty() ? "" : "; the " + around) + ". ";
}

std::string yield_of_best(const Subject& of) {
  const std::string spec = spec_words(of.group.spec, of.group.scored_by);
  if (!of.best().yield || spec.empty()) return "";
  const Yield& yield = *of.best().yield;
  std::string text = (of.by_yield ? of.best().method + " has the highest yield: " : "Yield: ") +
                     std::to_string(yield.in) + " of " + counted(yield.n, "instance") + " (95 % CI " +
                     whole_percent(yield.interval.low) + " to " + whole_percent(yield.interval.high) +
                     " %) meet the specification (" + spec + ")";
  if (const std::optional<TimeToSpec>& time = of.best().to_spec; time && std::isfinite(time->steps)) {
    // More instances may meet the specification at some step than at the end, so that the median time is below the
    // budget although the yield is under one half.
    if (time->successes > yield.in) text += "; " + std::to_string(time->successes) + " met it at some step";
    text += std::string(", half of all instances") +
            (of.group.spec.limits_mtf() ? " by " + of.group.scored_by.name : "") + " after " +
            of.group.words.until(static_cast<std::size_t>(std::ceil(time->steps)));
    if (std::isfinite(time->seconds)) text += " and " + number_text(time->seconds) + " s of machine time";
  }
  if (yield.uncured)
    text += "; before curing " + std::to_string(yield.uncured->in) + " of " + std::to_string(yield.uncured->n);
  return text + ". ";
}

// Of another method than the one with the lowest median.
std::string highest_yield(const Subject& of) {
  const auto most = std::max_element(of.ranked.methods.begin(), of.ranked.methods.end(),
                                     [&](const Row* a, const Row* b) { return yield_share(*a) < yield_share(*b); });
  if (*most == &of.best()) return "";
  return "The highest yield is that of " + (*most)->method + ": " + share_text(*(*most)->yield) + ". ";
}

std::string second_method(const Subject& of) {
  if (of.ranked.methods.size() < 2)
    return of.whole ? "No other method has a result. " : "No other method of this class has a result. ";
  const Row& next = *of.ranked.methods[1];
  if (of.by_yield) {
    if (!next.yield) return "No other method has a yield. ";
    const bool equal = yield_share(next) == yield_share(of.best());
    return "Second is " + next.method + " with " + (equal ? "the same yield" : share_text(*next.yield)) + ". ";
  }
  const std::string median = number_text(next.score().median);
  std::string text = "Second is " + next.method + " with " +
                     (median == number_text(of.best().score().median) ? "the same median" : median) +
                     failures_of(next) + ". ";
  const std::optional<Pair> pair = find_pair(of.group.pairs, of.best().method, next.method);
  if (pair && std::isfinite(pair->ratio)) text += verdict_sentence(*pair, of.relevant) + ". ";
  return text;
}

// The sentences that belong to the group rather than to a class.
std::string oracles_and_ground_truth(const Group& group, const Ranked& ranked, bool by_yield) {
  std::string text;
  for (const Row* oracle : ranked.oracles)
    text += "The oracle " + oracle->method + ", which is given the design pose, reaches " +
            (by_yield && oracle->yield ? share_text(*oracle->yield) : number_text(oracle->score().median)) + ". ";
  if (group.measured_only)
    text += group.station ? "Measured only: a station has no ground truth. "
                          : "Measured only: this scene has no ground truth. ";
  return text;
}

std::string nothing_ranked(const Group& group, const Ranked& ranked) {
  if (!ranked.oracles.empty()) return "only oracles have results; nothing can be ranked.";
  const bool any_trial =
      std::any_of(group.rows.begin(), group.rows.end(), [](const Row& row) { return row.trials > 0; });
  return any_trial ? "no measured or noise-free error was recorded; nothing can be ranked."
                   : "every trial failed; nothing can be ranked.";
}

std::string without_last_space(std::string text) {
  if (!text.empty()) text.pop_back();
  return text;
}

std::string sentences(const Subject& of) {
  if (of.ranked.methods.empty()) return nothing_ranked(of.group, of.ranked);
  const std::string first = of.by_yield ? yield_of_best(of) : lowest_error(of) + yield_of_best(of) + highest_yield(of);
  return without_last_space(first + second_method(of) +
                            (of.whole ? oracles_and_ground_truth(of.group, of.ranked, of.by_yield) : ""));
}

GroupVerdict verdict_of(const Group& group, double relevant, bool primary_is_yield) {
  const bool by_yield = primary_is_yield && !spec_words(group.spec, group.scored_by).empty() &&
                        std::any_of(group.rows.begin(), group.rows.end(),
                                    [](const Row& row) { return row.yield && row.has_score() && !row.oracle(); });
  const Ranked all(group, by_yield);
  GroupVerdict verdict;
  verdict.label = group.label;
  if (!all.methods.empty()) verdict.best = all.methods.front()->method;
  // Methods with different observations are not comparable: one ranking per class.
  for (const ObservationClass of_class : kClasses) {
    const Ranked ranked(group, by_yield, of_class);
    const bool has_yield = by_yield && !ranked.methods.empty() && ranked.methods.front()->yield;
    const Subject subject = {group, ranked, relevant, false, has_yield};
    if (!subject.ranked.methods.empty())
      verdict.classes.push_back(
          {of_class, group.words.observed(class_title(of_class)), subject.best().method, sentences(subject)});
  }
  if (verdict.classes.size() < 2) {
    verdict.classes.clear();
    verdict.text = sentences({group, all, relevant, true, by_yield});
    return verdict;
  }
  const std::string around = around_words(group);
  const std::string rest =
      (around.empty() ? "" : "The " + around + ". ") + oracles_and_ground_truth(group, all, by_yield);
  for (const ClassVerdict& one : verdict.classes) verdict.text += one.title + ": " + one.text + " ";
  verdict.text = without_last_space(verdict.text + rest);
  verdict.rest = without_last_space(rest);
  return verdict;
}

}  // namespace

std::vector<GroupVerdict> verdict(const PageModel& page) {
  std::vector<GroupVerdict> list;
  for (const Group& group : page.groups)
    list.push_back(verdict_of(group, page.smallest_relevant_ratio, page.analysis.primary_is_yield));
  return list;
}

std::vector<VerdictRow> verdict_rows(const Group& group) {
  std::vector<VerdictRow> rows;
  std::map<std::string, std::size_t> places;
  for (const Row& row : group.rows) {
    places[row.method] = rows.size();
    rows.push_back({&row, {}, 0});
  }
  for (const Pair& pair : group.pairs) {
    const auto a = places.find(pair.a), b = places.find(pair.b);
    if (a == places.end() || b == places.end()) continue;
    VerdictRow &first = rows[a->second], &second = rows[b->second];
    if (first.row->oracle() || first.row->of_class != second.row->of_class) continue;
    ++first.compared, ++second.compared;
    if (pair.verdict == statistics::Verdict::better) first.better_than.push_back(pair.b);
    if (pair.verdict == statistics::Verdict::worse) second.better_than.push_back(pair.a);
  }
  return rows;
}

namespace {

// A leader of a class, and in how many groups it is the first, and better than every other of its class.
struct ClassLead {
  std::string method;
  std::size_t first = 0, better = 0;
};

// "a at 2 of 3, better than every other, b at 1 of 3"
std::string lead_words(std::vector<ClassLead> leads, std::size_t groups) {
  std::stable_sort(leads.begin(), leads.end(),
                   [](const ClassLead& a, const ClassLead& b) { return a.first > b.first; });
  std::string words;
  for (const ClassLead& lead : leads)
    words += (words.empty() ? "" : ", ") + lead.method +
             (lead.first == groups ? "" : " at " + std::to_string(lead.first) + " of " + std::to_string(groups)) +
             (lead.better == lead.first ? ", better than every other" : "");
  return words;
}

// " at both groups", " at all 3 noise levels"
std::string everywhere_words(std::size_t groups, const std::string& groups_are) {
  return (groups == 2 ? " at both " : " at all " + std::to_string(groups) + " ") + groups_are;
}

// No median of a method, oracles apart, is below that of the start.
bool none_improves(const Group& group) {
  const Ranked ranked(group, false);
  return std::isfinite(group.start) && !ranked.methods.empty() &&
         std::none_of(ranked.methods.begin(), ranked.methods.end(),
                      [&](const Row* row) { return row->score().median < group.start; });
}

// "No method improves on the median error at the start at 2 of 3 noise levels. "; empty if one does in each group.
std::string start_words(const PageModel& page, const char* groups_are) {
  std::vector<const Group*> groups;
  for (const Group& group : page.groups)
    if (none_improves(group)) groups.push_back(&group);
  if (groups.empty()) return "";
  const std::size_t all = page.groups.size();
  return "No method improves on the median error at the start" +
         (all == 1 ? " (" + number_text(groups.front()->start) + ")"
          : groups.size() == all
              ? everywhere_words(all, groups_are)
              : " at " + std::to_string(groups.size()) + " of " + std::to_string(all) + " " + groups_are) +
         ". ";
}

}  // namespace

std::string headline(const PageModel& page) {
  const bool levels = page.scenes.size() == 1 && page.protocols.size() == 1 && !any_group(page, &Group::station);
  std::map<ObservationClass, std::vector<ClassLead>> leads;
  for (std::size_t index = 0; index < page.groups.size(); ++index) {
    const Group& group = page.groups[index];
    const std::vector<VerdictRow> rows = verdict_rows(group);
    const auto count = [&](ObservationClass of_class, const std::string& best) {
      std::vector<ClassLead>& list = leads[of_class];
      auto lead = std::find_if(list.begin(), list.end(), [&](const ClassLead& one) { return one.method == best; });
      if (lead == list.end()) lead = list.insert(list.end(), ClassLead{best});
      ++lead->first;
      for (const VerdictRow& row : rows)
        if (row.row->method == best && row.compared > 0 && row.better_than.size() == row.compared) ++lead->better;
    };
    for (const ClassVerdict& one : page.verdict[index].classes) count(one.of_class, one.best);
    if (!page.verdict[index].classes.empty() || page.verdict[index].best.empty()) continue;
    for (const VerdictRow& row : rows)
      if (row.row->method == page.verdict[index].best) count(row.row->of_class, row.row->method);
  }
  if (leads.empty()) return "";
  const std::size_t groups = page.groups.size();
  std::vector<std::string> parts;
  bool everywhere = groups > 1;
  for (const ObservationClass of_class : kClasses)
    if (const auto found = leads.find(of_class); found != leads.end()) {
      parts.push_back(lead_words(found->second, groups));
      if (leads.size() > 1) parts.back() += " among m" + common_words(page).observed(class_title(of_class)).substr(1);
      everywhere = everywhere && found->second.size() == 1 && found->second.front().first == groups;
    }
  const char* groups_are = levels ? "noise levels" : "groups";
  return start_words(page, groups_are) +
         (page.analysis.primary_is_yield             ? "Highest yield"
          : every_group(page, &Group::measured_only) ? "Lowest measured error"
                                                     : "Lowest median error") +
         (everywhere ? everywhere_words(groups, groups_are) : "") + ": " + join(parts, "; ") + ".";
}

std::string computing_time_note(const RunState& ran) {
  constexpr double kMaxHarness = 0.05;            // share of the scene's time
  constexpr double kFewHarnessMicroseconds = 50;  // per step: negligible for any scene
  if (!ran.harness || !(ran.harness->share_of_scene_time > kMaxHarness) ||
      ran.harness->microseconds_per_step <= kFewHarnessMicroseconds)
    return "";
  return "Harness overhead was " + significant(100 * ran.harness->share_of_scene_time, 2) +
         " % of the scene's time, on a busy machine mostly waiting for a core: do not compare compute times of this "
         "run. Errors are not affected.";
}

namespace {

constexpr std::size_t kFewInstances = 60;

// Of the group with the fewest; 0 without groups.
std::size_t fewest_instances(const PageModel& page) {
  std::size_t fewest = 0;
  for (const Group& group : page.groups) fewest = fewest == 0 ? group.instances : std::min(fewest, group.instances);
  return fewest;
}

bool budgets_differ(const Group& group) {
  return std::any_of(group.rows.begin(), group.rows.end(),
                     [&](const Row& row) { return row.step != group.rows.front().step; });
}

// " (instances 3, 17)"
std::string infeasible_names(const Group& group) {
  constexpr std::size_t kMaxNamed = 10;
  std::vector<std::string> names;
  for (const std::uint64_t instance : group.infeasible)
    if (names.size() < kMaxNamed) names.push_back(std::to_string(instance));
  if (names.empty()) return "";
  return std::string(names.size() == 1 ? " (instance " : " (instances ") + join(names, ", ") +
         (group.infeasible.size() > kMaxNamed ? ", ..." : "") + ")";
}

using Texts = std::vector<std::string>;

Texts oracle_caveats(const PageModel& page) {
  std::set<std::string> oracles;
  for (const Group& group : page.groups)
    for (const Row& row : group.rows)
      if (row.oracle()) oracles.insert(label_of(page.methods, row.method, group.protocol));
  Texts texts;
  for (const std::string& oracle : oracles)
    texts.push_back(oracle +
                    " is an oracle: it is given the design pose, which no method may observe under the blind " +
                    "protocol. It shows the value of this information and is not ranked.");
  return texts;
}

Texts infeasible_caveats(const PageModel& page) {
  Texts texts;
  for (const Group& group : page.groups)
    if (group.cannot_meet_spec > 0)
      texts.push_back(
          group.label + ": " + counted(group.cannot_meet_spec, "infeasible instance") + infeasible_names(group) +
          (group.spec.limits_mtf() ? ": neither the optimum nor the final pose of any method meets the specification."
                                   : ": even the optimum misses the specification."));
  return texts;
}

std::string brackets_text(const PageModel& page) {
  const std::size_t fewest = fewest_instances(page);
  if (fewest == 1) return "Results on a single instance do not generalise to other instances.";
  if (!any_row(page, [](const Row& row) { return row.score().interval.exists(); }))
    return "Brackets are quartiles (the middle half of the instances), not confidence intervals.";
  return "95 % intervals (CI) are bootstrap confidence intervals over instances. 'Better' requires the whole interval "
         "of the error ratio to be beyond the smallest relevant ratio of " +
         significant(page.smallest_relevant_ratio, 3) +
         (fewest < kFewInstances ? "; with only " + std::to_string(fewest) + " instances intervals are wide." : ".");
}

bool home_observes_the_start(const Row& row) { return row.method == "home" && !row.oracle(); }

}  // namespace

std::vector<std::string> caveats(const PageModel& page) {
  const RunState& ran = page.ran;
  const SceneWords words = common_words(page);
  const struct {
    bool applies;
    Texts texts;
  } table[] = {
      {ran.missing > 0,
       {"Partial results: " + std::to_string(ran.missing) + " of " + counted(ran.planned, "trial") +
        " have not finished, and all numbers below may change."}},
      {page.without_suite,
       {"manifest.json lacks the text of its suite, so that instances, methods, specification and analysis plan could "
        "not be compared with a suite."}},
      {ran.failed > 0,
       {counted(ran.failed, "trial") +
        " failed. Failed trials are excluded from medians and curves, which favours methods that fail on hard "
        "instances; the ranking lists their number."}},
      {!computing_time_note(ran).empty(), {computing_time_note(ran)}},
      {!every_group(page, &Group::same_instances),
       {"Not every method has finished the same instances, so some medians are over different instances."}},
      {any_group(page, budgets_differ), {"Methods have different step budgets; see the column 'steps'."}},
      {true, oracle_caveats(page)},
      {any_group(page, &Group::measured_only),
       {"Measured only: the error is the lowest measured " + common_score(page).name +
        ", noise included. As a minimum over all " + words.captures() +
        " it favours methods that take many. True poses, noise-free errors and the result of fixing the " +
        words.device + " at the recommended pose are unknown."}},
      {any_group(page, &Group::station),
       {"Trials on a station cannot be replayed: its " + words.devices +
        ", start poses and stage vary from trial to trial in unknown ways. home, which needs the true start pose, is "
        "left out."}},
      {any_row(page, home_observes_the_start),
       {"home makes a single move to the nominal pose, which the paper protocol lets it observe: near the optimum if " +
        words.device + " and stage are nearly perfect, far from it otherwise."}},
      {ran.finished > 0, {brackets_text(page)}},
      {ran.finished > 0, infeasible_caveats(page)},
  };
  Texts list;
  for (const auto& [applies, texts] : table)
    if (applies) list.insert(list.end(), texts.begin(), texts.end());
  return list;
}

}  // namespace relign::report
