// Limits shared by several modules.
#pragma once

namespace relign {

// Steps of a trial, in suites, on the command line and in records. In records it bounds the memory that a report takes
// for an untrusted file.
inline constexpr unsigned kMaxSteps = 100'000;

}  // namespace relign
