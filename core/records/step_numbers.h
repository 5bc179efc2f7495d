// Of a step's line the numbers that curves are made of. A report looks at every step of a study; reading whole records
// for it would take ten times as long.
#pragma once

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
};

// Keeps its parser's memory from line to line. Not thread-safe.
class StepNumbersReader {
 public:
  StepNumbersReader();
  ~StepNumbersReader();
  StepNumbersReader(StepNumbersReader&&) noexcept;
  StepNumbersReader& operator=(StepNumbersReader&&) noexcept;

  // `line` without its newline. Throws Error(bad_input) that starts with `place`; what it does not need of the line
  // is not looked at.
  StepNumbers read(std::string_view line, std::string_view place);

 private:
  struct Parser;
  std::unique_ptr<Parser> parser_;
};

}  // namespace relign::records
