// "relign.prepared/1": loads in a trial what the algorithm learnt in pretraining on source instances, and saves it
// during pretraining. The caller stores the data between uses (runner/pretraining_store.h).
#pragma once

#include <map>
#include <memory>
#include <string>

#include "trials/services.h"

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

class PretrainingService {
 public:
  explicit PretrainingService(ServiceContext& shared);
  PretrainingService(const PretrainingService&) = delete;
  PretrainingService& operator=(const PretrainingService&) = delete;
  const relign_pretraining_service* table() const { return &table_; }

 private:
  static PretrainingService& self(void* context) { return *static_cast<PretrainingService*>(context); }
  PretrainingState* state() const;  // null outside of pretraining, and for an algorithm that another one runs
  relign_status load(const relign_text_sink* data);
  relign_status save(relign_text data);

  ServiceContext* shared_;
  relign_pretraining_service table_{};
};

}  // namespace relign::trials
