// Fast reader for the numbers of a step that curves are drawn from. A report reads every step of a study; reading
// whole records would take ten times as long.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "records/record.h"

namespace relign::records {

struct StepNumbers : StepRecord {
  // After curing at the commanded pose: by_step[current] of the closing line, or commanded_mse where curing shifts
  // nothing. NaN where the record lacks it. set_scores sets it, and best_mse.
  double glued_mse = kUnknown;
  // by_step[best]; NaN where the record has none: then the glued_mse at the step of the lowest measured RMSE.
  double best_mse = kUnknown;
};

void set_scores(const TrialRecord& closing, std::vector<StepNumbers>& steps);

// Keeps its parser's memory from line to line. Not thread-safe.
class StepNumbersReader {
 public:
  StepNumbersReader();
  ~StepNumbersReader();
  StepNumbersReader(StepNumbersReader&&) noexcept;
  StepNumbersReader& operator=(StepNumbersReader&&) noexcept;

  // `line` without its newline. Throws as read_trial_line.
  StepNumbers read(std::string_view line, std::string_view place);

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

}  // namespace relign::records
