// Limits shared by several modules.
#pragma once

#include <cstddef>

namespace relign {

// Axes of a scene: the flags of limits are the bits of one 64-bit word.
inline constexpr std::size_t kMaxAxes = 64;

// Steps of a trial, in suites, on the command line and in records. In records it bounds the memory that a report takes
// for an untrusted file.
inline constexpr unsigned kMaxSteps = 100'000;

// Trials of a suite: a plan of them takes one gigabyte and some minutes.
inline constexpr unsigned long long kMaxTrials = 10'000'000;

// Characters of an id or a path in a suite.
inline constexpr unsigned kMaxNameLength = 4096;

}  // namespace relign
