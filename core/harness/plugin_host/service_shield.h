// The services of a trial as a plugin gets them: copies of the host's tables with guarded functions, like those of the
// trial itself.
#pragma once

#include <relign/plugin.h>

#include <exception>
#include <string_view>

#include "plugin_host/guard.h"

namespace relign::plugin_host {

// Guards calls from a plugin into the host: they run with the host's floating-point state, and no exception
// unwinds through the plugin's frames. After the first exception every call returns RELIGN_STOP.
class CallbackShield {
 public:
  explicit CallbackShield(const FloatingPointState& host_state) : host_state_(host_state) {}
  CallbackShield(const CallbackShield&) = delete;
  CallbackShield& operator=(const CallbackShield&) = delete;

  template <class Body>
  relign_status call(Body&& body) noexcept {
    if (thrown_) return RELIGN_STOP;
    const FloatingPointState plugin_state = FloatingPointState::current();
    host_state_.apply();
    relign_status status = RELIGN_STOP;
    try {
      status = body();
    } catch (...) {
      thrown_ = std::current_exception();
    }
    plugin_state.apply();
    return status;
  }
  std::exception_ptr thrown() const { return thrown_; }

 private:
  FloatingPointState host_state_;
  std::exception_ptr thrown_;
};

class ShieldedServices {
 public:
  explicit ShieldedServices(CallbackShield& shield) : shield_(&shield) {}
  ShieldedServices(const ShieldedServices&) = delete;
  ShieldedServices& operator=(const ShieldedServices&) = delete;

  // The plugin's copy of `service`, valid as long as this object; null for null, and for unknown ids.
  const void* shielded(std::string_view id, const void* service);

 private:
  template <class Service>
  struct Pair {
    Service outer{};
    const Service* inner = nullptr;
    CallbackShield* shield = nullptr;
  };
  template <class Service, auto Function, class... Arguments>
  static relign_status pass(void* context, Arguments... arguments);
  template <class Service>
  void fill(Pair<Service>& pair, const void* service);

  CallbackShield* shield_;
  Pair<relign_measures_service> measures_;
  Pair<relign_regions_service> regions_;
  Pair<relign_prior_service> prior_;
  Pair<relign_history_service> history_;
  Pair<relign_run_service> run_;
  Pair<relign_model_service> model_;
  Pair<relign_pretraining_service> prepared_;
};

}  // namespace relign::plugin_host
