#include <exception>
#include <type_traits>

#include "plugin_host/guard.h"
#include "plugin_host/library.h"
#include "plugin_host/objects.h"
#include "plugin_host/process_algorithm.h"
#include "plugin_host/service_shield.h"

namespace relign::plugin_host {

struct Algorithm::Implementation {
  Implementation(const Choice& choice, const HostServices& services)
      : manifest(choice.plugin), host(*choice.plugin, services) {}

  std::shared_ptr<const Manifest> manifest;
  ObjectHost host;
  const relign_algorithm_interface* table = nullptr;
  relign_algorithm* object = nullptr;
  std::unique_ptr<ProcessAlgorithm> process;  // instead of table and object
};

namespace {

// The conversation as the plugin gets it: every function switches to the host's floating-point
// state and back, and keeps exceptions from unwinding through the plugin's frames.
class ShieldedConversation {
 public:
  ShieldedConversation(const relign_conversation& talk, const FloatingPointState& host_state)
      : talk_(talk), callbacks_(host_state) {
    shield_.struct_size = sizeof shield_;
    shield_.context = this;
    shield_.task = talk.task;
    shield_.first = [](void* context, relign_observation* seen) {
      return self(context).shielded([&](const relign_conversation& inner) { return inner.first(inner.context, seen); });
    };
    shield_.step = [](void* context, const double* pose, std::uint32_t axes, relign_observation* seen) {
      return self(context).shielded(
          [&](const relign_conversation& inner) { return inner.step(inner.context, pose, axes, seen); });
    };
    shield_.move = [](void* context, const double* delta, std::uint32_t axes, relign_observation* seen) {
      return self(context).shielded(
          [&](const relign_conversation& inner) { return inner.move(inner.context, delta, axes, seen); });
    };
    shield_.recommend = [](void* context, const double* pose, std::uint32_t axes) {
      return self(context).shielded(
          [&](const relign_conversation& inner) { return inner.recommend(inner.context, pose, axes); });
    };
    shield_.get_service = [](void* context, relign_text id) -> const void* {
      const void* service = nullptr;
      self(context).shielded([&](const relign_conversation& inner) -> relign_status {
        if (inner.get_service)
          service = self(context).services_.shielded({id.data, static_cast<std::size_t>(id.size)},
                                                     inner.get_service(inner.context, id));
        return RELIGN_OK;
      });
      return service;
    };
  }
  ShieldedConversation(const ShieldedConversation&) = delete;
  ShieldedConversation& operator=(const ShieldedConversation&) = delete;

  const relign_conversation* shield() const { return &shield_; }
  std::exception_ptr thrown() const { return callbacks_.thrown(); }

 private:
  static ShieldedConversation& self(void* context) { return *static_cast<ShieldedConversation*>(context); }

  template <class Body>
  relign_status shielded(Body&& body) noexcept {
    return callbacks_.call([&] { return body(talk_); });
  }

  const relign_conversation& talk_;
  CallbackShield callbacks_;
  ShieldedServices services_{callbacks_};
  relign_conversation shield_{};
};

}  // namespace

Algorithm::Algorithm(const Choice& choice, const HostServices& services)
    : implementation_(std::make_unique<Implementation>(choice, services)) {
  Implementation& mine = *implementation_;
  if (!mine.manifest->command.empty()) {
    mine.process = std::make_unique<ProcessAlgorithm>(choice, services);
    return;
  }
  const auto* table = static_cast<const relign_algorithm_interface*>(
      plugin_interface(*mine.manifest, RELIGN_ALGORITHM_INTERFACE,
                       offsetof(relign_algorithm_interface, destroy) + sizeof(relign_algorithm_interface::destroy)));
  require_function(*mine.manifest, RELIGN_ALGORITHM_INTERFACE, "create", table->create);
  require_function(*mine.manifest, RELIGN_ALGORITHM_INTERFACE, "run", table->run);
  require_function(*mine.manifest, RELIGN_ALGORITHM_INTERFACE, "destroy", table->destroy);
  mine.table = table;
  const ParameterTable parameters(choice);
  const relign_status status = mine.host.call("create", [&](const FloatingPointState&) {
    return table->create(mine.host.host(), parameters.table(), &mine.object);
  });
  if (status != RELIGN_OK || !mine.object) mine.host.throw_failure("create", "it made no object and gives no reason");
}

Algorithm::~Algorithm() {
  Implementation& mine = *implementation_;
  if (!mine.object) return;
  const FloatingPointGuard guard(mine.host.plugin_id());
  try {
    mine.table->destroy(mine.object);
  } catch (...) {  // a destructor has nobody to tell
  }
}

void Algorithm::run(const relign_conversation& talk) {
  Implementation& mine = *implementation_;
  if (mine.process) return mine.process->run(talk);
  std::exception_ptr thrown;
  const auto body = [&](const FloatingPointState& host_state) {
    ShieldedConversation conversation(talk, host_state);
    const relign_status status = mine.table->run(mine.object, conversation.shield());
    thrown = conversation.thrown();
    return thrown ? RELIGN_OK : status;
  };
  const relign_status status = mine.host.call("run", body);
  if (thrown) std::rethrow_exception(thrown);
  if (status == RELIGN_UNSUPPORTED) mine.host.throw_failure("run", "it says that it does not support this trial");
}

}  // namespace relign::plugin_host
