// Runs submitted algorithms: the self-test of `submit`, and the check of a submission's environment.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "cli/app.h"
#include "submissions/submission.h"

namespace relign::cli {

// A folder of its own below the system's temporary folder, removed with its files. Throws Error(io).
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// Throws Error(bad_input) unless the Python of this machine (RELIGN_PYTHON, else python3) has every package of the
// submission's lock file in that version. Does nothing without a lock file.
void check_environment(const submissions::Submission& submission, const std::filesystem::path& folder);

// Lets the submission in `folder` align its few steps, in the context's sandbox if there is one, and replays the trial.
// `entry` is its entry of a suite, valid in any folder. Throws Error(bad_input) if the trial fails, or if its replay
// has other records: results of such a method cannot be verified; Error(stopped).
void run_self_test(Context& context, const submissions::Submission& submission, const Json& entry);

void add_submit_evaluate(CLI::App& submit, Context& context);  // below submit

}  // namespace relign::cli
