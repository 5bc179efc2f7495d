// Two records of the same trial: where they first differ. For replays and for duplicates.
#pragma once

#include <optional>
#include <string>

#include "records/record.h"

namespace relign::records {

struct Difference {
  bool closing = false;  // in the closing line, not in a step
  unsigned step = 0;
  std::string field;    // "measured", "commanded_pose[1]", "end"
  std::string was, is;  // as written in the files
  double size = 0;      // |is - was| of numbers, infinite otherwise
};

// "step 3, measured: was 0.041, is 0.042"
std::string to_string(const Difference& difference);

// The first difference in the order of the lines and their fields. Nothing when all agree. Numbers agree when they are
// the same double or when |is - was| <= tolerance (1 + |was|); 0 asks for equal bits. NaN agrees with NaN.
std::optional<Difference> first_difference(const TrialRecord& was, const TrialRecord& is, double tolerance = 0);

// The largest |is - was| / (1 + |was|) over all numbers of the steps that both have.
double largest_difference(const TrialRecord& was, const TrialRecord& is);

// For sentences: "compass on relign_od rho0.25 #3".
std::string label_of(const TrialRecord& trial);

// What is granted between processors to a plugin that promises equal numbers on one alone ("this_cpu").
inline constexpr double kOtherCpuTolerance = 1e-6;

}  // namespace relign::records
