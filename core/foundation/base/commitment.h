// The commitment of a sealed suite to its secret (docs/sealed.md).
#pragma once

#include <string>

#include "base/hash.h"

namespace relign {

inline constexpr const char* kCommitmentPrefix = "sha256:";

// "sha256:" and 64 hex digits.
inline std::string commitment_to(const std::string& secret) {
  return kCommitmentPrefix + sha256_hex("relign-bench commitment\n" + secret);
}

}  // namespace relign
