// The results of an earlier run in the same folder: the trials that still count, and those that run again.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "records/results_folder.h"
#include "runner/run_reporter.h"

namespace relign::runner {

class EarlierRun {
 public:
  // All must outlive this object. `selected`: positions in the plan of the trials of this run.
  EarlierRun(const PreparedPlan& plan, const RunOptions& options, const std::vector<std::size_t>& selected,
             records::ResultsWriter& writer, RunReporter& reporter);

  // Removes finished trials that this plan would not reproduce, because their plugins or display names changed, and
  // with RunOptions::retry_failed those that failed.
  using PluginsOf = std::function<records::PluginHashes(const suites::PlannedTrial&)>;
  void drop_outdated(const PluginsOf& plugins_of);

  // Throws Error(bad_input) when trials of the folder ran in a sandbox and those to come will not, or the other way
  // round.
  void compare_sandbox() const;
  // Reports finished trials that another program or another suite made. They are kept, and the new manifest lists the
  // programs.
  void compare_with(records::Manifest& manifest) const;

  // An analysis plan that was changed after the first results is not pre-registered: marks it in the new manifest.
  void mark_changed_analysis(records::Manifest& manifest) const;

  // A secret that was published stays published.
  void keep_secret(records::Manifest& manifest) const;

  // The selected trials that are not finished.
  struct Remaining {
    std::vector<std::size_t> places;
    std::size_t finished = 0;  // the others
    std::size_t failed = 0;    // of these
  };
  Remaining remaining() const;

 private:
  // Which finished trials must run again, and why.
  struct Outdated;
  void check(std::size_t place, const records::FinishedTrial& before, const records::PluginHashes& now,
             Outdated& outdated) const;
  void report(const Outdated& outdated) const;
  void remove_scene_files(std::size_t scene) const;

  const PreparedPlan& plan_;
  const suites::Suite& suite_;
  const RunOptions& options_;
  const std::vector<std::size_t>& selected_;
  records::ResultsWriter& writer_;
  RunReporter& reporter_;
  const std::optional<records::Manifest> manifest_;  // as written by the earlier run, if there is one
};

}  // namespace relign::runner
