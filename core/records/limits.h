// What a record may say, so that a stranger's line does not decide how much memory a report takes.
#pragma once

namespace relign::records {

inline constexpr unsigned kMostSteps = 100'000;  // of a trial, as in a suite

}  // namespace relign::records
