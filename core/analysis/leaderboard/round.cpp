#include "leaderboard/round.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "base/json_members.h"
#include "base/text.h"
#include "report/scene_axes.h"
#include "report/statistics_data.h"
#include "statistics/quantiles.h"

namespace relign::leaderboard {
namespace {

namespace fs = std::filesystem;
using report::Aggregate;
using report::LoadedResults;
using report::Method;
using report::ObservationClass;

constexpr std::size_t kMaxRoundPictureBytes = 64'000'000;

using NameAndProtocol = std::pair<std::string, std::string>;

constexpr const char* kWordOrder[] = {"images", "merit", "start", "box", "design", "level", "history"};

// By kWordOrder; other words after these, as text.
bool word_before(const std::string& a, const std::string& b) {
  const auto place = [](const std::string& word) {
    return std::find(std::begin(kWordOrder), std::end(kWordOrder), word) - std::begin(kWordOrder);
  };
  return place(a) != place(b) ? place(a) < place(b) : a < b;
}

struct ClassKey {
  bool oracles = false;
  std::vector<std::string> observes;  // sorted by word_before
  std::string name() const { return (oracles ? "oracles " : "") + join(observes, " "); }
};

ClassKey class_of(const Method& method) {
  ClassKey key = {method.of_class == ObservationClass::oracle,
                  report::observed_words(method, method.protocol != "blind")};
  std::sort(key.observes.begin(), key.observes.end(), word_before);
  return key;
}

std::map<NameAndProtocol, ClassKey> classes_of(const LoadedResults& results) {
  const std::map<std::string, std::string> lists = report::training_lists(results.manifest);
  std::map<NameAndProtocol, ClassKey> classes;
  const report::Methods methods(results);
  for (const Method& method : methods.list()) {
    const auto list = lists.find(method.name);
    classes[{list == lists.end() ? method.name : list->second, method.protocol}] = class_of(method);
  }
  return classes;
}

statistics::StudyOptions options_of(const LoadedResults& results, const std::string& baseline) {
  statistics::StudyOptions options = report::study_options(results);
  const report::Methods methods(results);
  for (const Method& method : methods.list()) options.classes[{method.name, method.protocol}] = class_of(method).name();
  options.baseline = baseline;
  return options;
}

// Of one method: its trials.
struct Trials {
  std::size_t all = 0, failed = 0;
  std::vector<double> images, machine_seconds, compute_seconds;

  void add(const statistics::TrialRow& row) {
    ++all;
    if (!row.counts()) {
      ++failed;
      return;
    }
    images.push_back(row.steps);
    machine_seconds.push_back(std::isnan(row.recommended_seconds()) ? row.machine_seconds()
                                                                    : row.recommended_seconds());
    compute_seconds.push_back(row.algorithm_ms_per_step * row.last_step / 1000);
  }
};

std::map<NameAndProtocol, Trials> trials_of(const LoadedResults& results) {
  std::map<NameAndProtocol, Trials> all;
  for (const statistics::TrialRow& row : results.trials.rows) {
    const statistics::Series& series = results.trials.series_of(row);
    all[{method_of(series), series.protocol}].add(row);
  }
  return all;
}

statistics::Band turned(const statistics::Band& share) {
  return {share.n, 1 - share.estimate, {1 - share.interval.high, 1 - share.interval.low}};
}

// Probability that `a` ends below `b`.
statistics::Band improvement(const Aggregate& aggregate, const std::string& a, const std::string& b) {
  if (const report::AggregatePair* pair = aggregate.pair_of(a, b)) return pair->improvement;
  if (const report::AggregatePair* pair = aggregate.pair_of(b, a)) return turned(pair->improvement);
  return {};
}

// As evaluation.json states it, else as the results do: stated by the plugin, or the images of pretraining.
std::optional<TrainingCost> training_of(const std::string& name, const std::string& protocol,
                                        const std::vector<EvaluatedMethod>& listed, const report::PageModel& page) {
  for (const EvaluatedMethod& method : listed)
    if (method.name == name && method.protocol == protocol && method.training) return method.training;
  for (const report::TrainingCost& training : page.training) {
    if (training.method != report::label_of(page.methods, name, protocol)) continue;
    TrainingCost cost;
    (training.stated ? cost.steps : cost.images) = training.steps;
    cost.hours = training.hours;
    cost.hardware = training.machine;
    return cost;
  }
  return std::nullopt;
}

Standing standing_of(const report::AggregateMethod& from, std::size_t strata, const Trials& trials) {
  Standing standing;
  standing.method = from.method;
  standing.page = method_page(from.method);
  standing.training_tag = from.training_tag;
  standing.trials = trials.all;
  standing.failed = trials.failed;
  standing.images = statistics::quantiles(trials.images).median;
  standing.machine_seconds = statistics::quantiles(trials.machine_seconds).median;
  standing.compute_seconds = statistics::quantiles(trials.compute_seconds).median;
  if (from.has_numbers()) {
    standing.error = from.bands.iqm;
    standing.mean_error = from.bands.gap;
    standing.by_step = from.by_step;
  } else {
    standing.not_ranked =
        "results in " + std::to_string(from.strata) + " of " + std::to_string(strata) + " scenes and noise levels";
  }
  return standing;
}

// The standings of one protocol, by class.
void add_classes(Round& round, const Aggregate& aggregate, const std::map<NameAndProtocol, ClassKey>& classes,
                 const std::map<NameAndProtocol, Trials>& trials, const std::vector<EvaluatedMethod>& listed) {
  const std::size_t before = round.classes.size();
  for (const report::AggregateMethod& method : aggregate.methods) {
    const NameAndProtocol key = {method.method, aggregate.protocol};
    const auto found = classes.find(key);
    const ClassKey of_class = found == classes.end() ? ClassKey() : found->second;
    auto place = std::find_if(
        round.classes.begin() + static_cast<std::ptrdiff_t>(before), round.classes.end(),
        [&](const BoardClass& one) { return one.oracles == of_class.oracles && one.observes == of_class.observes; });
    if (place == round.classes.end())
      place = round.classes.insert(place, {of_class.observes, aggregate.protocol, of_class.oracles, {}});
    const auto own = trials.find(key);
    Standing standing = standing_of(method, aggregate.strata.size(), own == trials.end() ? Trials() : own->second);
    standing.training = training_of(method.method, aggregate.protocol, listed, round.page);
    if (method.method != round.baseline)
      standing.beats_baseline = improvement(aggregate, method.method, round.baseline);
    if (!place->standings.empty())
      standing.beaten_by_best = improvement(aggregate, place->standings.front().method, method.method);
    if (place->oracles) standing.not_ranked = "oracles are not ranked";
    if (standing.not_ranked.empty()) standing.rank = place->standings.size() + 1;
    place->standings.push_back(std::move(standing));
  }
}

// The methods of the results by the name that standings have.
void find_baseline(Round& round, const std::vector<records::ManifestMethod>& algorithms, const std::string& wanted) {
  std::set<std::string> by_id;
  for (const records::ManifestMethod& entry : algorithms) {
    if (entry.listed_name() == wanted) round.baseline = wanted;
    if (entry.id == wanted) by_id.insert(entry.listed_name());
  }
  if (round.baseline.empty() && by_id.size() == 1) round.baseline = *by_id.begin();
  if (round.baseline.empty()) {
    round.about_baseline = "none, because no method of this round is '" + wanted + "'";
    return;
  }
  std::set<std::string> about;
  for (const records::ManifestMethod& entry : algorithms) {
    if (entry.listed_name() != round.baseline) continue;
    if (entry.id != round.baseline) about.insert("is '" + entry.id + "'");
    if (entry.steps < round.steps) about.insert("has only " + counted(entry.steps, "step") + " per alignment");
  }
  if (!about.empty())
    round.about_baseline = "'" + round.baseline + "', which " + join({about.begin(), about.end()}, " and ");
}

}  // namespace

std::vector<std::string> reasons_without_ranking(const Round& round) {
  std::vector<std::string> reasons;
  for (const BoardClass& of_class : round.classes)
    for (const Standing& standing : of_class.standings) {
      if (standing.rank > 0) return {};
      reasons.push_back("'" + standing.method + "' (protocol " + of_class.protocol + "): " + standing.not_ranked);
    }
  if (reasons.empty())
    reasons.emplace_back(
        "no trial has a normalised error, which needs noise-free errors at the start, at the end and at the instance's "
        "optimum");
  return reasons;
}

std::string method_of(const statistics::Series& series) {
  return series.method.empty() ? series.algorithm : series.method;
}

void read_standings(Round& round, const fs::path& folder, const std::vector<EvaluatedMethod>& listed,
                    const std::string& baseline, bool pictures) {
  const LoadedResults results = report::load_results(folder);
  find_baseline(round, results.manifest.algorithms, baseline);
  const statistics::Study study = statistics::make_study(results.trials, options_of(results, round.baseline));
  round.page = report::page_model(results, study);
  round.commitment = results.manifest.commitment;
  round.secret = results.manifest.secret;
  round.instances = round.page.instances;
  for (const report::QualityGate& gate : round.page.gates)
    if (!gate.ok) round.alarms.push_back(gate.name + ": " + gate.text);
  const auto classes = classes_of(results);
  const auto trials = trials_of(results);
  for (const Aggregate& aggregate : round.page.aggregates) {
    if (round.strata.empty()) round.strata = aggregate.strata;
    add_classes(round, aggregate, classes, trials, listed);
  }
  std::stable_sort(round.classes.begin(), round.classes.end(), [](const BoardClass& a, const BoardClass& b) {
    if (a.oracles != b.oracles) return b.oracles;
    if (a.protocol != b.protocol) return a.protocol < b.protocol;
    return std::lexicographical_compare(a.observes.begin(), a.observes.end(), b.observes.begin(), b.observes.end(),
                                        word_before);
  });
  if (!pictures) return;
  round.gallery = report::load_gallery(folder, kMaxRoundPictureBytes);
  round.gallery.axes = report::scene_axes(folder, results.manifest);
}

const Standing* find_standing(const Round& round, const std::string& method, const std::string& protocol,
                              const BoardClass** of_class) {
  for (const BoardClass& one : round.classes)
    for (const Standing& standing : one.standings)
      if (standing.method == method && one.protocol == protocol) {
        if (of_class) *of_class = &one;
        return &standing;
      }
  return nullptr;
}

}  // namespace relign::leaderboard
