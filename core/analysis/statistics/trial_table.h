// The trials of a results folder without their steps, which are read from the files when a curve needs them. About 250
// bytes per trial: a million trials take a quarter of a gigabyte.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "base/scene_score.h"
#include "records/folder_checks.h"
#include "records/stored_trials.h"
#include "statistics/band.h"
#include "statistics/rules.h"

namespace relign::statistics {

struct TrialRow {
  std::string trial;  // id
  records::StoredTrial where;
  std::uint64_t instance = 0;
  std::uint32_t series = 0;                                // of TrialTable::series
  std::uint32_t end = 0, message = 0, recommendation = 0;  // of TrialTable::texts
  unsigned budget = 0;
  unsigned steps = 0;      // recorded, including step 0
  unsigned last_step = 0;  // number of the last one
  bool ended_well = false;
  double own_optimum_mse = kMissing;  // NaN: unknown
  // Score before the adhesive cures, at the last recommendation by each rule; NaN without a cure shift.
  ByRule<double> uncured = {{kMissing, kMissing, kMissing}};
  std::uint32_t mtf = 0;       // of TrialTable::mtf
  std::uint32_t criteria = 0;  // of TrialTable::criteria
  // Score at step 0; NaN if missing.
  double start_measured = kMissing;
  double start_commanded = kMissing;
  std::array<double, kTracks.size()> last = {};             // of each track, at the last step
  std::array<double, records::kTabledColumns> tabled = {};  // of the last step
  std::vector<double> tabled_of_trial;                      // of TrialTable::tabled; empty: none of them is known
  double algorithm_ms_per_step = kMissing;                  // host time; NaN: unknown

  bool counts() const { return ended_well && steps > 0; }  // part of curves and medians; else a failure
  // Simulated seconds until the last step, and including the move to the recommended pose (NaN if unknown).
  double machine_seconds() const { return tabled[records::tabled_place("machine_seconds")]; }
  double recommended_seconds() const { return tabled[records::tabled_place("recommended_seconds")]; }
  double last_of(Track track) const { return last[static_cast<std::size_t>(track)]; }
};

// MTF of a trial; NaN if the specification does not measure it.
struct TrialMtf {
  ByRule<ByCuring<records::MtfRecord>> by;  // at the last recommendation by each rule
  records::MtfRecord own_optimum;
};

// Criteria of a specification that are judged after every step; NaN without them.
struct TrialCriteria {
  ByCriterion<double> last = records::Specification::none();  // at the last recommendation, by the own rule
  std::vector<double> further_at_optimum;                     // further scores at the own optimum; empty: unknown
  double optimum_deficit = kMissing;                          // of MTF by field, at the instance's own optimum
};

// The trials of one algorithm on one scene, noise level and protocol.
struct Series {
  std::string scene, noise_level, protocol, algorithm;  // display names
  std::string algorithm_id;                             // plugin or preset
  std::string method, training;       // of a method with several trainings its name and the training's; else empty
  std::vector<std::uint32_t> trials;  // rows with counts(), in the folder's order
  std::size_t failed = 0;
  unsigned largest_budget = 0;  // of these trials
  SceneScore score;             // of the scene
};

class TrialTable {
 public:
  std::filesystem::path folder;
  std::deque<TrialRow> rows;   // in the folder's order; a deque, so that addresses stay valid
  std::vector<Series> series;  // in order of first appearance
  std::vector<std::string> texts = {""};
  std::vector<std::string> tabled;             // keys of the trials' columns with kTabled
  std::vector<TrialMtf> mtf = {{}};            // the first is for trials without MTF
  std::vector<TrialCriteria> criteria = {{}};  // the first is for trials without criteria

  struct Warning {
    std::uint32_t series = 0, text = 0;
    bool operator==(const Warning& other) const { return series == other.series && text == other.text; }
  };
  struct Counted {
    Warning warning;
    std::size_t count = 0;
  };
  std::vector<Counted> warnings;  // of plugins, with their number

  // Sums over all trials that recorded them.
  double harness_seconds = 0, scene_seconds = 0;
  std::size_t timed_steps = 0;

  const std::string& text(std::uint32_t number) const { return texts[number]; }
  const TrialMtf& mtf_of(const TrialRow& row) const { return mtf[row.mtf]; }
  bool has_mtf() const { return mtf.size() > 1; }
  const TrialCriteria& criteria_of(const TrialRow& row) const { return criteria[row.criteria]; }
  bool has_criteria() const { return criteria.size() > 1; }
  // Whether some trial has a value of tabled[place].
  bool has_tabled(std::size_t place) const {
    return std::any_of(rows.begin(), rows.end(), [place](const TrialRow& row) {
      return !row.tabled_of_trial.empty() && std::isfinite(row.tabled_of_trial[place]);
    });
  }
  // Whether the last recommendation by the rule meets all limits; those judged after every step by the own rule only.
  bool meets(const TrialRow& row, const records::Specification& spec, Rule rule) const {
    const records::MtfRecord& of_lens = mtf_of(row).by[rule][Curing::after];
    return spec.met_by(row.last_of(track_of(rule)), of_lens.centre, of_lens.corner) &&
           (rule == Rule::own ? spec.criteria_met_by(criteria_of(row).last) : !spec.limits_criteria());
  }
  const Series& series_of(const TrialRow& row) const { return series[row.series]; }
};

// One value per trial of the series, at its last step.
std::vector<double> last_values(const TrialTable& table, const Series& series, Track track);

using ScoresByScene = std::map<std::string, SceneScore>;

struct ReadTable {
  TrialTable table;
  std::size_t left_out = 0;             // complete trials that are not wanted
  std::vector<std::string> incomplete;  // wanted trials with steps but no closing line
};
// Reads trials/ and times/ of a folder, line by line. `wanted` selects trials by id (empty: all). If a trial is
// recorded twice, the first record is used. `scores` by scene, those of others are the RMSE. `checks` gets every trial
// and its times. Throws Error as records::for_each_with_steps.
ReadTable read_trial_table(const std::filesystem::path& folder,
                           const std::function<bool(const std::string& trial)>& wanted = {},
                           records::FolderChecks* checks = nullptr, const ScoresByScene& scores = {});

}  // namespace relign::statistics
