#include <exception>
#include <map>
#include <type_traits>

#include "plugin_host/library_object.h"
#include "plugin_host/objects.h"
#include "plugin_host/process_algorithm.h"
#include "plugin_host/service_tables.h"

namespace relign::plugin_host {

namespace {

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

// The services as the plugin gets them: copies of the host's tables with guarded functions.
class ShieldedServices {
 public:
  explicit ShieldedServices(CallbackShield& shield) : shield_(&shield) {}
  ShieldedServices(const ShieldedServices&) = delete;
  ShieldedServices& operator=(const ShieldedServices&) = delete;

  // The plugin's copy of `service`, valid as long as this object; null for null, and for unknown ids.
  const void* shielded(std::string_view id, const void* service) {
    if (!service) return nullptr;
    return find_service(outer_, id, [&](auto& outer) {
      outer = *static_cast<const std::remove_reference_t<decltype(outer)>*>(service);
      outer.context = &(inner_[&outer] = {service, shield_});
      for_each_function(outer, [&](auto member) { outer.*member.pointer = Guarded<decltype(member)>::call; });
      return true;
    });
  }

 private:
  struct Inner {
    const void* table;
    CallbackShield* shield;
  };
  template <class Function>
  struct Guarded;
  template <class Table, class... Arguments, relign_status (*Table::*Function)(void*, Arguments...)>
  struct Guarded<Member<Function>> {
    static relign_status call(void* context, Arguments... arguments) {
      const Inner& inner = *static_cast<const Inner*>(context);
      const Table& table = *static_cast<const Table*>(inner.table);
      return inner.shield->call([&] { return (table.*Function)(table.context, arguments...); });
    }
  };

  CallbackShield* shield_;
  ServiceTables outer_;
  std::map<const void*, Inner> inner_;  // by table of the plugin
};

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
    shield_.why = [](void* context, const relign_text_sink* reason) {
      return self(context).shielded([&](const relign_trial& inner) { return inner.why(inner.context, reason); });
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
