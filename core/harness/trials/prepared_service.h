// "relign.prepared/1": what an algorithm learnt beforehand on source instances, loaded in trials and saved while it is
// prepared. Keeping it from one use to the next is the caller's (runner/prepared_store.h).
#pragma once

#include <map>
#include <memory>
#include <string>

#include "trials/services.h"

namespace relign::trials {

// What was prepared for one algorithm on one scene, noise level and protocol.
struct PreparedData {
  std::shared_ptr<const std::string> bytes;  // null: nothing
  std::string hash;                          // SHA-256 of the bytes
  std::string failure;                       // why there is nothing although it was tried; a trial that loads is told
};

// Of the algorithm of a trial and of those it runs, by Choice::identity.
using PreparedByIdentity = std::map<std::string, PreparedData>;

// A conversation on a source instance: the trial's own algorithm is being prepared.
struct Preparing {
  unsigned source = 0;
  unsigned sources = 0;
  std::shared_ptr<const std::string> bytes;  // what was saved last; null: nothing yet
};

class PreparedService {
 public:
  explicit PreparedService(ServiceSite& site);
  PreparedService(const PreparedService&) = delete;
  PreparedService& operator=(const PreparedService&) = delete;
  const relign_prepared_service* table() const { return &table_; }

 private:
  static PreparedService& self(void* context) { return *static_cast<PreparedService*>(context); }
  Preparing* preparing() const;  // null in a trial, and for an algorithm that another one runs
  relign_status load(const relign_text_sink* data);
  relign_status save(relign_text data);

  ServiceSite* site_;
  relign_prepared_service table_{};
};

}  // namespace relign::trials
