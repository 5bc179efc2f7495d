// Fast reader for the numbers of a step that curves are drawn from. A report reads every step of a study; reading
// whole records would take ten times as long.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace relign::records {

struct StepNumbers {  // as in StepRecord
  unsigned step = 0;
  double measured = 0;
  double machine_seconds = 0, recommended_seconds = 0;
  double commanded_mse = 0, recommended_mse = 0;
  std::string recommendation;
  std::vector<double> recommended_true_pose;
  double merit = 0;
  bool of_regions = false;  // the capture reads out regions, so that `measured` is NaN
  // After curing at the commanded pose: TrialRecord::glued_mse, or commanded_mse where curing shifts nothing. NaN where
  // the record lacks it. set_glued sets it, and best_mse, from the trial's closing line.
  double glued_mse = std::numeric_limits<double>::quiet_NaN();
  // TrialRecord::best_mse; NaN where the record has none: then the glued_mse at the step of the lowest measured RMSE.
  double best_mse = std::numeric_limits<double>::quiet_NaN();
};

struct TrialRecord;
void set_glued(const TrialRecord& closing, std::vector<StepNumbers>& steps);

// Keeps its parser's memory from line to line. Not thread-safe.
class StepNumbersReader {
 public:
  StepNumbersReader();
  ~StepNumbersReader();
  StepNumbersReader(StepNumbersReader&&) noexcept;
  StepNumbersReader& operator=(StepNumbersReader&&) noexcept;

  // `line` without its newline. Throws Error(bad_input) that starts with `place`. Checks of the members
  // that it does not need that each is there once.
  StepNumbers read(std::string_view line, std::string_view place);

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

}  // namespace relign::records
