// A results folder as statistics see it: every trial once, without its steps, which are read again where they lie when
// a curve needs them. About 250 bytes a trial, so that a million fit in a quarter of a gigabyte.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <unordered_map>
#include <vector>

#include "records/stored_trials.h"
#include "statistics/rules.h"

namespace relign::statistics {

struct TrialRow {
  std::string trial;  // id
  records::StoredTrial where;
  std::uint64_t instance = 0;
  std::uint32_t series = 0;                                // of TrialTable::series
  std::uint32_t end = 0, message = 0, recommendation = 0;  // of TrialTable::texts
  unsigned budget = 0;
  unsigned steps = 0;      // with a record, the start among them
  unsigned last_step = 0;  // number of the last one
  bool ended_well = false;
  double own_optimum_mse = std::numeric_limits<double>::quiet_NaN();  // NaN: not known
  // RMSE before the glue cures, at the last recommendation by each rule; NaN where it shifts nothing.
  ByRule<double> uncured = {{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::quiet_NaN()}};
  std::uint32_t mtf = 0;  // of TrialTable::mtf
  // A merit that no definition gives: negative, or below the measured RMSE, which every one of them contains.
  bool impossible_merit = false;
  // RMSE; NaN when there is none.
  double start_measured = std::numeric_limits<double>::quiet_NaN();
  double start_commanded = std::numeric_limits<double>::quiet_NaN();
  std::array<double, kTracks.size()> last = {};  // of each track, at the last step
  // Simulated seconds until the last step; with the move back to the recommended pose (NaN where nobody knows it).
  double machine_seconds = std::numeric_limits<double>::quiet_NaN();
  double recommended_seconds = std::numeric_limits<double>::quiet_NaN();
  double algorithm_ms_per_step = std::numeric_limits<double>::quiet_NaN();  // host time; NaN: not known

  bool counts() const { return ended_well && steps > 0; }  // enters curves and medians; else it is a failure
  double last_of(Track track) const { return last[static_cast<std::size_t>(track)]; }
};

// A trial's MTF where the specification asked for it; NaN where it does not.
struct TrialMtf {
  ByRule<records::MtfRecord> glued, uncured;  // at the last recommendation by each rule
  records::MtfRecord own_optimum;
};

// The trials of one algorithm on one scene, noise level and protocol.
struct Series {
  std::string scene, noise_level, protocol, algorithm;  // names shown
  std::string algorithm_id;                             // plugin or preset
  std::string method, training;                         // of a list of trainings its name and this one's; else empty
  std::vector<std::uint32_t> trials;                    // rows that count, in the folder's order
  std::size_t failed = 0;
  unsigned largest_budget = 0;  // of those that count
};

class TrialTable {
 public:
  std::filesystem::path folder;
  std::deque<TrialRow> rows;   // in the folder's order; they stay where they are while it grows
  std::vector<Series> series;  // in order of first appearance
  std::vector<std::string> texts = {""};
  std::vector<TrialMtf> mtf = {{}};  // the first is of the trials that tell none

  struct Warning {
    std::uint32_t series = 0, text = 0;
    bool operator==(const Warning& other) const { return series == other.series && text == other.text; }
  };
  struct Counted {
    Warning warning;
    std::size_t count = 0;
  };
  std::vector<Counted> warnings;  // what plugins left behind, and how often

  // Over all trials that tell it.
  double harness_seconds = 0, scene_seconds = 0;
  std::size_t timed_steps = 0;

  const std::string& text(std::uint32_t number) const { return texts[number]; }
  const TrialMtf& mtf_of(const TrialRow& row) const { return mtf[row.mtf]; }
  bool tells_mtf() const { return mtf.size() > 1; }
  const Series& series_of(const TrialRow& row) const { return series[row.series]; }
  // Trials that count and lack what another rule than `own` needs: records of an earlier program, of levels whose glue
  // shifts the lens or of specifications of MTF. A replay adds it.
  std::size_t without_rules = 0;
};

// Of each trial that counts, at its last step.
std::vector<double> last_values(const TrialTable& table, const Series& series, Track track);

// Reads trials/ and times/ of a folder, a line at a time. `wanted` says which trials belong (all, when empty); of a
// trial that is there twice the first record counts. `left_out` counts complete trials that are not wanted;
// `incomplete` gets wanted trials that have steps but no closing line. Throws Error as for_each_with_steps does.
struct ReadTable {
  TrialTable table;
  std::size_t left_out = 0;
  std::vector<std::string> incomplete;
};
ReadTable read_trial_table(const std::filesystem::path& folder,
                           const std::function<bool(const std::string& trial)>& wanted = {});

}  // namespace relign::statistics
