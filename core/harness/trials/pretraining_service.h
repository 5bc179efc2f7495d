// "relign.prepared/1": loads in a trial what the algorithm learnt in pretraining on source instances, and saves it
// during pretraining. The caller stores the data between uses (runner/pretraining_store.h).
#pragma once

#include "trials/pretraining.h"
#include "trials/services.h"

namespace relign::trials {

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
