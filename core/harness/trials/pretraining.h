// Pretraining as data: what an algorithm learnt on source instances, and the state of a trial that pretrains it. The
// service "prepared" (services.cpp) reads and writes both.
#pragma once

#include <map>
#include <memory>
#include <string>

namespace relign::trials {

// The result of pretraining one algorithm on one scene, noise level and protocol.
struct PretrainingData {
  std::shared_ptr<const std::string> bytes;  // null: none
  std::string hash;                          // SHA-256 of the bytes
  std::string failure;                       // why pretraining failed; a trial gets it when it loads
};

// For the algorithm of a trial and for those it runs, by Choice::identity.
using PreparedByIdentity = std::map<std::string, PretrainingData>;

// State of a trial on a source instance, in which the trial's own algorithm is pretrained.
struct PretrainingState {
  unsigned source = 0;
  unsigned sources = 0;
  std::shared_ptr<const std::string> bytes;  // saved last; null: nothing yet
};

}  // namespace relign::trials
