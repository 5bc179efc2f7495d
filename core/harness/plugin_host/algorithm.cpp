#include <exception>

#include "plugin_host/library_object.h"
#include "plugin_host/objects.h"
#include "plugin_host/process_algorithm.h"
#include "plugin_host/service_shield.h"

namespace relign::plugin_host {

namespace {

// The trial as the plugin gets it: every function switches to the host's floating-point state and back, and keeps
// exceptions from unwinding through the plugin's frames.
class ShieldedTrial {
 public:
  ShieldedTrial(const relign_trial& trial, const FloatingPointState& host_state)
      : trial_(trial), callbacks_(host_state) {
    shield_.struct_size = sizeof shield_;
    shield_.context = this;
    shield_.task = trial.task;
    shield_.first = [](void* context, relign_observation* observation) {
      return self(context).shielded([&](const relign_trial& inner) { return inner.first(inner.context, observation); });
    };
    shield_.step = [](void* context, const double* pose, std::uint32_t axes, relign_observation* observation) {
      return self(context).shielded(
          [&](const relign_trial& inner) { return inner.step(inner.context, pose, axes, observation); });
    };
    shield_.move = [](void* context, const double* delta, std::uint32_t axes, relign_observation* observation) {
      return self(context).shielded(
          [&](const relign_trial& inner) { return inner.move(inner.context, delta, axes, observation); });
    };
    shield_.recommend = [](void* context, const double* pose, std::uint32_t axes) {
      return self(context).shielded(
          [&](const relign_trial& inner) { return inner.recommend(inner.context, pose, axes); });
    };
    shield_.get_service = [](void* context, relign_text id) -> const void* {
      const void* service = nullptr;
      self(context).shielded([&](const relign_trial& inner) -> relign_status {
        if (inner.get_service)
          service = self(context).services_.shielded({id.data, static_cast<std::size_t>(id.size)},
                                                     inner.get_service(inner.context, id));
        return RELIGN_OK;
      });
      return service;
    };
  }
  ShieldedTrial(const ShieldedTrial&) = delete;
  ShieldedTrial& operator=(const ShieldedTrial&) = delete;

  const relign_trial* shield() const { return &shield_; }
  std::exception_ptr thrown() const { return callbacks_.thrown(); }

 private:
  static ShieldedTrial& self(void* context) { return *static_cast<ShieldedTrial*>(context); }

  template <class Body>
  relign_status shielded(Body&& body) noexcept {
    return callbacks_.call([&] { return body(trial_); });
  }

  const relign_trial& trial_;
  CallbackShield callbacks_;
  ShieldedServices services_{callbacks_};
  relign_trial shield_{};
};

const relign_algorithm_interface& algorithm_table(const Manifest& manifest) {
  const auto& table = table_of<relign_algorithm_interface>(manifest, RELIGN_ALGORITHM_INTERFACE);
  require_function(manifest, RELIGN_ALGORITHM_INTERFACE, "run", table.run);
  return table;
}

class LibraryAlgorithm {
 public:
  LibraryAlgorithm(const Choice& choice, const HostServices& services)
      : object_(choice, services, algorithm_table(*choice.plugin)) {}

  void run(const relign_trial& trial) {
    std::exception_ptr thrown;
    const auto body = [&](const FloatingPointState& host_state) {
      ShieldedTrial shielded(trial, host_state);
      const relign_status status = object_.table().run(object_.get(), shielded.shield());
      thrown = shielded.thrown();
      return thrown ? RELIGN_OK : status;
    };
    const relign_status status = object_.host().call("run", body);
    if (thrown) std::rethrow_exception(thrown);
    if (status == RELIGN_UNSUPPORTED) object_.host().throw_failure("run", "it does not support this trial");
  }

 private:
  LibraryObject<relign_algorithm_interface, relign_algorithm> object_;
};

}  // namespace

struct Algorithm::Implementation {
  // Exactly one of the two is set.
  std::unique_ptr<LibraryAlgorithm> library;
  std::unique_ptr<ProcessAlgorithm> process;
};

Algorithm::Algorithm(const Choice& choice, const HostServices& services)
    : implementation_(std::make_unique<Implementation>()) {
  if (choice.plugin->command.empty() && !services.sandbox)
    implementation_->library = std::make_unique<LibraryAlgorithm>(choice, services);
  else
    implementation_->process = std::make_unique<ProcessAlgorithm>(choice, services);
}

Algorithm::~Algorithm() = default;

void Algorithm::run(const relign_trial& trial) {
  if (implementation_->process) return implementation_->process->run(trial);
  implementation_->library->run(trial);
}

}  // namespace relign::plugin_host
