// All numbers and texts of a report, without its pictures. Sections, figures, tables and exports read this model and
// nothing else; page_json.h writes it for `report --format json`.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "report/loaded_results.h"
#include "report/methods.h"
#include "report/page_group.h"
#include "report/provenance.h"
#include "report/scene_axes.h"
#include "statistics/study.h"

namespace relign::report {

struct FailedTrial {
  std::string trial, scene, noise_level, protocol;
  std::uint64_t instance = 0;
  unsigned steps = 0;
  std::string log;  // file; "" if nothing was printed
};

// Trials of a method that failed with the same message.
struct Failure {
  std::string method, message;
  std::size_t count = 0;
  std::vector<FailedTrial> trials;  // the first ones
};

struct PluginWarning {
  std::string method, message;
  std::size_t count = 0;
};

struct RunState {
  std::size_t planned = 0, finished = 0, failed = 0, missing = 0;  // missing: includes incomplete ones
  std::vector<std::string> incomplete;                             // interrupted trials
  std::size_t from_other_plans = 0;
  struct Harness {
    double microseconds_per_step = kMissing, share_of_scene_time = kMissing;
  };
  std::optional<Harness> harness;  // overhead over the trials that recorded it
};

struct QualityGate {
  std::string name;
  bool ok = false;
  std::string text;  // short if passed, a sentence if failed
};

struct ClassVerdict {
  ObservationClass of_class = ObservationClass::unknown;
  std::string title, best, text;  // "Methods that observe images"
};

// Of one group. Texts begin with the name of the best method, "" if nothing can be ranked.
struct GroupVerdict {
  std::string label, best, text;
  std::vector<ClassVerdict> classes;  // if there are several; then `rest` is the part of no class
  std::string rest;
};

// When the training of a method pays in one group.
struct BreakEven {
  std::size_t group = 0;  // index into groups
  std::string label;
  double lenses = kMissing;   // infinite: never
  std::string against;        // the fastest method without training, "" if there is none
  double saves = kMissing;    // seconds per lens
  double modules = kMissing;  // good ones, until savings against the baseline pay for the training; infinite: never
};

struct TrainingCost {
  std::string method;  // label
  double hours = kMissing;
  double steps = kMissing;  // images
  bool stated = false;      // in the manifest; else the images of pretraining
  std::string machine;
  std::vector<BreakEven> pays_after;
};

// The parameters of simulated machine time, with their names in files.
struct ClockParameter {
  const char *name, *unit;
};
inline constexpr std::array kClockParameters = {
    ClockParameter{"speed_mm_per_s", " mm/s"}, ClockParameter{"speed_deg_per_s", " degrees/s"},
    ClockParameter{"settle_ms", " ms to settle"}, ClockParameter{"exposure_ms", " ms exposure"},
    ClockParameter{"readout_ms", " ms readout"}};

// Noise-free score of the nominal lens along an axis; `away` is the distance from the nominal pose, % of the travel.
struct LandscapeLine {
  std::string axis, unit;
  std::vector<double> away, score;
};

// The same over two axes, row by row from the lower ends.
struct LandscapePlane {
  struct Axis {
    std::string name, unit;
    std::vector<double> values;
  };
  Axis across, up;
  std::vector<double> score;
};

struct SceneFacts {
  std::string scene, id, summary;
  std::uint64_t width = 0, height = 0;  // of its images; 0: unknown
  // Missing: unknown, or a speed that no axis has, for it has its own.
  std::array<double, kClockParameters.size()> clock = {kMissing, kMissing, kMissing, kMissing, kMissing};
  std::vector<SceneAxis> axes;
  SceneScore scored_by;
  SceneWords words;
  std::vector<std::string> readings;     // instead of images, or beside them
  std::vector<LandscapeLine> landscape;  // empty: unknown
  std::optional<LandscapePlane> plane;
};

struct AggregateTraining {
  std::string name;
  std::size_t failed = 0;
  statistics::AggregateBands bands;
};

struct AggregateMethod {
  std::string method, training_tag;
  ObservationClass of_class = ObservationClass::unknown;
  std::size_t strata = 0, failed = 0;  // strata with a result; in fewer than all there are no numbers
  unsigned steps = 0;
  statistics::AggregateBands bands;  // iqm.n is 0 without numbers
  std::vector<double> by_step;       // optimality gap after each step
  std::vector<AggregateTraining> trainings;
  struct Spread {
    double lowest = kMissing, highest = kMissing, sd = kMissing;
  };
  std::optional<Spread> spread;  // of the IQM between several trainings

  bool has_numbers() const { return bands.iqm.n > 0; }
  bool oracle() const { return of_class == ObservationClass::oracle; }
};

struct Stratum {
  std::string scene, noise_level;
  std::size_t instances = 0;
};

// Probability of improvement of a over b.
struct AggregatePair {
  std::string a, b;
  statistics::Band improvement;
};

// Over all scenes and noise levels of a protocol (docs/statistics.md).
struct Aggregate {
  std::string protocol;
  std::string label;             // of the folder, if the page has several
  double resolution = kMissing;  // of the score, if its scenes have the same
  std::vector<Stratum> strata;
  std::vector<AggregateMethod> methods;  // best first
  std::vector<AggregatePair> pairs;

  const AggregatePair* pair_of(const std::string& a, const std::string& b) const;  // nullptr without one
};

// The analysis plan and its outcome.
struct Analysis {
  Json plan;  // as in the manifest, with its hash; empty without a plan
  std::string summary;
  bool primary_is_yield = false;
  double yield = kMissing;         // target
  std::vector<std::string> notes;  // plan changed after the run began, page by another rule than the plan's
};

// A folder, or several with the same instance set, on a page of several sets.
struct PagePart {
  std::string label;
  Provenance provenance;
};

struct PageModel {
  std::string title;
  Provenance provenance;        // empty on a page of several sets
  std::vector<PagePart> parts;  // of several sets; else empty
  bool merged_for_this_page = false;
  std::vector<std::string> scenes, noise_levels, protocols;
  struct StepRange {
    unsigned least = 0, most = 0;
  };
  std::optional<StepRange> steps;  // budgets of the trials
  std::size_t instances = 0;
  RunState ran;
  std::vector<Method> methods;
  std::vector<Group> groups;
  std::vector<Failure> failures;
  std::vector<PluginWarning> warnings;
  statistics::Rule rule = statistics::Rule::own;  // behind everything named recommended, yield, to_spec, ecdf, pairs
  std::vector<double> targets;                    // scores, descending
  std::size_t resamples = 0;
  double smallest_relevant_ratio = 1;
  Json spec;                   // of the suite, as in the manifest
  std::string spec_text;       // a sentence, if all groups have the same specification
  bool without_suite = false;  // the manifest could not be compared with the suite (records::Manifest::has_suites)
  std::vector<QualityGate> gates;
  std::vector<Aggregate> aggregates;  // one per protocol with ground truth
  std::vector<SceneFacts> scene_facts;
  std::vector<TrainingCost> training;
  std::string rules_note;
  Analysis analysis;
  std::vector<GroupVerdict> verdict;  // one per group
  std::vector<std::string> caveats;
};

PageModel page_model(const LoadedResults& results, const statistics::Study& study);
PageModel page_model(const LoadedResults& results);  // computes the study

// By what the groups are judged; "score" where they differ.
SceneScore common_score(const PageModel& page);

// Of all groups.
SceneWords common_words(const PageModel& page);

// `has` is a member or a function of Group, or of Row.
template <class Has>
bool any_group(const PageModel& page, const Has& has) {
  for (const Group& group : page.groups)
    if (std::invoke(has, group)) return true;
  return false;
}
template <class Has>
bool every_group(const PageModel& page, const Has& has) {
  for (const Group& group : page.groups)
    if (!std::invoke(has, group)) return false;
  return true;
}
template <class Has>
bool any_row(const PageModel& page, const Has& has) {
  return any_group(page, [&](const Group& group) {
    for (const Row& row : group.rows)
      if (std::invoke(has, row)) return true;
    return false;
  });
}

}  // namespace relign::report
