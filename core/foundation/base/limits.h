// Limits that several rooms keep to.
#pragma once

namespace relign {

// Steps of a trial: in suites and on the command line, and in records, so that a stranger's line does not decide how
// much memory a report takes.
inline constexpr unsigned kMostSteps = 100'000;

}  // namespace relign
