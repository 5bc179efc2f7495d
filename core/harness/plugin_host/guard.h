// Guards every call into a plugin, and every call back from it.
//
// A plugin may change the processor's floating-point mode (loading a library linked with -ffast-math is enough), report
// a failure, or let an exception escape although it must not. None of this may affect the simulator or other plugins.
#pragma once

#include <relign/plugin.h>

#include <cfenv>
#include <cstdint>
#include <map>
#include <mutex>
#include <new>
#include <string>
#include <thread>

#include "base/error.h"
#include "plugin_host/objects.h"

namespace relign::plugin_host {

// Rounding mode, treatment of subnormal numbers and masked exceptions of this thread; on x86-64 the control words of
// both floating-point units.
class FloatingPointState {
 public:
  static FloatingPointState current();
  void apply() const;
  // Compares the modes, not the sticky flags that any inexact operation raises.
  bool same_mode(const FloatingPointState& other) const;
  // "flush-to-zero was switched on, the rounding mode was changed"
  std::string changes_to(const FloatingPointState& later) const;

 private:
#if defined(__x86_64__)
  std::uint32_t mxcsr_ = 0;
  std::uint16_t x87_ = 0;
#else
  std::fenv_t environment_{};
#endif
  int rounding_ = 0;
};

// Restores the floating-point state at the end of its scope and, if it had changed, counts the change for this thread.
// `plugin_id` is borrowed.
class FloatingPointGuard {
 public:
  explicit FloatingPointGuard(const std::string& plugin_id)
      : plugin_id_(plugin_id), before_(FloatingPointState::current()) {}
  ~FloatingPointGuard();
  FloatingPointGuard(const FloatingPointGuard&) = delete;
  FloatingPointGuard& operator=(const FloatingPointGuard&) = delete;
  const FloatingPointState& before() const { return before_; }

 private:
  const std::string& plugin_id_;
  FloatingPointState before_;
};

// Number of changes that guards of this thread found, and a message on the last one.
struct FloatingPointChanges {
  std::uint64_t count = 0;
  std::string last;
};
const FloatingPointChanges& floating_point_changes();

// The host's side of one plugin object: its relign_host, the messages that it passes to host->fail, and guarded calls
// of its functions.
class ObjectHost {
 public:
  ObjectHost(const Manifest& manifest, const HostServices& services);
  ObjectHost(const ObjectHost&) = delete;
  ObjectHost& operator=(const ObjectHost&) = delete;

  const relign_host* host() const { return &host_; }
  const std::string& plugin_id() const { return plugin_id_; }

  // Runs `body`, which calls the plugin's function `what` and returns its status. Returns RELIGN_OK,
  // RELIGN_STOP or RELIGN_UNSUPPORTED; throws Error(plugin_failed) for everything else.
  template <class Body>
  relign_status call(const char* what, Body&& body) {
    forget_failure();
    relign_status status = RELIGN_FAILED;
    const char* escaped = nullptr;
    {
      FloatingPointGuard guard(plugin_id_);
      try {
        status = body(guard.before());
      } catch (const std::bad_alloc&) {
        escaped = "out of memory";
      } catch (...) {
        escaped = "an exception escaped from the library; catch it in the plugin, as plugin.hpp does";
      }
    }
    if (escaped) throw_failure(what, escaped);
    if (status != RELIGN_OK && status != RELIGN_STOP && status != RELIGN_UNSUPPORTED)
      throw_failure(what, failure_text(status));
    return status;
  }

  [[noreturn]] void throw_failure(const char* what, const std::string& message) const;

 private:
  void forget_failure();
  std::string failure_text(relign_status status);

  std::string plugin_id_;
  std::string folder_;
  std::string cache_;
  std::function<void(int, const std::string&)> log_;
  relign_host host_{};
  std::mutex mutex_;
  // By thread, because a scene's assemblies may fail in several threads at once.
  std::map<std::thread::id, std::string> failures_;
};

// A relign_text_sink that collects into a string.
class TextSink {
 public:
  TextSink();
  const relign_text_sink* sink() const { return &sink_; }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  relign_text_sink sink_{};
};

// The effective parameters of a choice in the form that create gets; valid during create.
class ParameterTable {
 public:
  explicit ParameterTable(const Choice& choice);
  ParameterTable(const ParameterTable&) = delete;
  ParameterTable& operator=(const ParameterTable&) = delete;
  const relign_parameters* table() const { return &table_; }

 private:
  const Choice& choice_;
  std::string json_;
  relign_parameters table_{};
};

}  // namespace relign::plugin_host
