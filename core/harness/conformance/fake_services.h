// The services of a fake trial (RELIGN_SERVICE_*): real measures, a synthetic scene (synthetic.h), and a short walk in
// place of any inner algorithm. As strict as the host's services (trials/services.h), and null unless the manifest
// declares what they need.
#pragma once

#include <memory>

#include "conformance/fake_trial.h"
#include "plugin_host/catalog.h"

namespace relign::conformance {

class FakeServices {
 public:
  // Installs itself in `trial` for its lifetime. Both arguments must outlive it.
  FakeServices(const plugin_host::Choice& choice, FakeTrial& trial);
  ~FakeServices();
  FakeServices(const FakeServices&) = delete;
  FakeServices& operator=(const FakeServices&) = delete;

  struct State;  // what the functions of all services share

 private:
  std::unique_ptr<State> state_;
};

}  // namespace relign::conformance
