// One object of a plugin's library: creates, calls (guarded) and destroys it. The kinds of plugins differ only in their
// tables.
#pragma once

#include <relign/plugin.h>

#include <cstddef>
#include <type_traits>
#include <utility>

#include "plugin_host/guard.h"
#include "plugin_host/library.h"

namespace relign::plugin_host {

// The table of functions of one interface, complete up to `destroy`. Throws Error(plugin_rejected).
template <class Table>
const Table& table_of(const Manifest& manifest, const char* interface_id) {
  const auto* table = static_cast<const Table*>(
      plugin_interface(manifest, interface_id, offsetof(Table, destroy) + sizeof(Table::destroy)));
  require_function(manifest, interface_id, "create", table->create);
  require_function(manifest, interface_id, "destroy", table->destroy);
  return *table;
}

template <class Table, class Object>
class LibraryObject {
 public:
  // Throws Error(plugin_failed) when create fails.
  LibraryObject(const Choice& choice, const HostServices& services, const Table& table)
      : host_(*choice.plugin, services), table_(table) {
    const ParameterTable parameters(choice);
    demand("create", "it returned no object and no reason", [&] {
      const relign_status status = table_.create(host_.host(), parameters.table(), &object_);
      return status == RELIGN_OK && !object_ ? RELIGN_UNSUPPORTED : status;
    });
  }
  ~LibraryObject() {
    quietly([this] { table_.destroy(object_); });
  }
  LibraryObject(const LibraryObject&) = delete;
  LibraryObject& operator=(const LibraryObject&) = delete;

  ObjectHost& host() { return host_; }
  const Table& table() const { return table_; }
  Object* get() const { return object_; }

  // Runs `body`, which calls the plugin's function `what`. Throws Error(plugin_failed) unless it returns RELIGN_OK;
  // `if_not` is the message for a plugin that gives none.
  template <class Body>
  void demand(const char* what, const char* if_not, Body&& body) {
    const relign_status status = host_.call(what, [&](const FloatingPointState&) -> relign_status { return body(); });
    if (status != RELIGN_OK) host_.throw_failure(what, if_not);
  }

  // The same for a function that a plugin may lack: false when it returned RELIGN_UNSUPPORTED.
  template <class Body>
  bool offers(const char* what, const char* if_not, Body&& body) {
    const relign_status status = host_.call(what, [&](const FloatingPointState&) -> relign_status { return body(); });
    if (status == RELIGN_STOP) host_.throw_failure(what, if_not);
    return status == RELIGN_OK;
  }

  // Runs `body` and ignores failures, for destructors.
  template <class Body>
  void quietly(Body&& body) noexcept {
    const FloatingPointGuard guard(host_.plugin_id());
    try {
      body();
    } catch (...) {
    }
  }

 private:
  ObjectHost host_;
  const Table& table_;
  Object* object_ = nullptr;
};

}  // namespace relign::plugin_host
