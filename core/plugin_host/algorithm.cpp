#include <exception>
#include <type_traits>

#include "plugin_host/guard.h"
#include "plugin_host/library.h"
#include "plugin_host/objects.h"

namespace relign::plugin_host {

struct Algorithm::Implementation {
  Implementation(const Choice& choice, const HostServices& services)
      : manifest(choice.plugin), host(*choice.plugin, services) {}

  std::shared_ptr<const Manifest> manifest;
  ObjectHost host;
  const relign_algorithm_interface* table = nullptr;
  relign_algorithm* object = nullptr;
};

namespace {

// The conversation as the plugin gets it: every function switches to the host's floating-point
// state and back, and keeps exceptions from unwinding through the plugin's frames.
class ShieldedConversation {
 public:
  ShieldedConversation(const relign_conversation& talk, const FloatingPointState& host_state)
      : talk_(talk), host_state_(host_state) {
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
        if (inner.get_service) service = inner.get_service(inner.context, id);
        return RELIGN_OK;
      });
      return service;
    };
  }
  ShieldedConversation(const ShieldedConversation&) = delete;
  ShieldedConversation& operator=(const ShieldedConversation&) = delete;

  const relign_conversation* shield() const { return &shield_; }
  std::exception_ptr thrown() const { return thrown_; }

 private:
  static ShieldedConversation& self(void* context) { return *static_cast<ShieldedConversation*>(context); }

  template <class Body>
  relign_status shielded(Body&& body) noexcept {
    if (thrown_) return RELIGN_STOP;
    const FloatingPointState plugin_state = FloatingPointState::current();
    host_state_.apply();
    relign_status status = RELIGN_STOP;
    try {
      status = body(talk_);
    } catch (...) {
      thrown_ = std::current_exception();
    }
    plugin_state.apply();
    return status;
  }

  const relign_conversation& talk_;
  FloatingPointState host_state_;
  relign_conversation shield_{};
  std::exception_ptr thrown_;
};

}  // namespace

Algorithm::Algorithm(const Choice& choice, const HostServices& services)
    : implementation_(std::make_unique<Implementation>(choice, services)) {
  Implementation& mine = *implementation_;
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
