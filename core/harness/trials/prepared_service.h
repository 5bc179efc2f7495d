// "relign.prepared/1": loads in a trial what the algorithm learnt in pretraining on source instances, and saves it
// during pretraining. The caller stores the data between uses (runner/prepared_store.h).
#pragma once

#include <map>
#include <memory>
#include <string>

#include "trials/services.h"

namespace relign::trials {

// The result of pretraining one algorithm on one scene, noise level and protocol.
struct PreparedData {
  std::shared_ptr<const std::string> bytes;  // null: none
  std::string hash;                          // SHA-256 of the bytes
  std::string failure;                       // why pretraining failed; a trial gets it when it loads
};

// For the algorithm of a trial and for those it runs, by Choice::identity.
using PreparedByIdentity = std::map<std::string, PreparedData>;

// State of a trial on a source instance, in which the trial's own algorithm is pretrained.
struct Preparing {
  unsigned source = 0;
  unsigned sources = 0;
  std::shared_ptr<const std::string> bytes;  // saved last; null: nothing yet
};

class PreparedService {
 public:
  explicit PreparedService(ServiceContext& shared);
  PreparedService(const PreparedService&) = delete;
  PreparedService& operator=(const PreparedService&) = delete;
  const relign_prepared_service* table() const { return &table_; }

 private:
  static PreparedService& self(void* context) { return *static_cast<PreparedService*>(context); }
  Preparing* preparing() const;  // null outside of pretraining, and for an algorithm that another one runs
  relign_status load(const relign_text_sink* data);
  relign_status save(relign_text data);

  ServiceContext* shared_;
  relign_prepared_service table_{};
};

}  // namespace relign::trials
