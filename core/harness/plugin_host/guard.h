// The guard around every call into a plugin, and around every call back from it.
//
// A plugin may change the processor's floating-point mode (merely loading a library linked with
// -ffast-math does), report a failure, or let an exception escape although it must not. None of
// that may reach the simulator or the other plugins.
#pragma once

#include <relign/plugin.h>

#include <cfenv>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "base/error.h"
#include "plugin_host/objects.h"

namespace relign::plugin_host {

// Rounding, treatment of subnormal numbers and masked exceptions of this thread; on x86-64 the
// control words of both floating-point units.
class FloatingPointState {
 public:
  static FloatingPointState current();
  void apply() const;
  // Equal in mode; the sticky flags that any inexact operation raises do not count.
  bool same_mode(const FloatingPointState& other) const;
  // "flush-to-zero was switched on, the rounding direction was changed"
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

// Restores the floating-point state at the end of its scope and remembers, for this thread, that it
// had to. `culprit` is borrowed.
class FloatingPointGuard {
 public:
  explicit FloatingPointGuard(const std::string& culprit) : culprit_(culprit), before_(FloatingPointState::current()) {}
  ~FloatingPointGuard();
  FloatingPointGuard(const FloatingPointGuard&) = delete;
  FloatingPointGuard& operator=(const FloatingPointGuard&) = delete;
  const FloatingPointState& before() const { return before_; }

 private:
  const std::string& culprit_;
  FloatingPointState before_;
};

// How often a guard of this thread found the state changed, and what it would say of the last time.
struct FloatingPointChanges {
  std::uint64_t count = 0;
  std::string last;
};
const FloatingPointChanges& floating_point_changes();

// What one plugin object needs of the host for its whole life: its relign_host, the sentences it
// gives to host->fail, and the guarded way to call it.
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
    bool escaped = false;
    {
      FloatingPointGuard guard(plugin_id_);
      try {
        status = body(guard.before());
      } catch (...) {
        escaped = true;
      }
    }
    if (escaped)
      throw_failure(what, "an exception left the library, which plugins must never let happen (plugin.hpp guards it)");
    if (status != RELIGN_OK && status != RELIGN_STOP && status != RELIGN_UNSUPPORTED)
      throw_failure(what, failure_text(status));
    return status;
  }

  [[noreturn]] void throw_failure(const char* what, const std::string& sentence) const;

 private:
  void forget_failure();
  std::string failure_text(relign_status status);

  std::string plugin_id_;
  std::string folder_;
  std::string cache_;
  std::function<void(int, const std::string&)> log_;
  relign_host host_{};
  std::mutex mutex_;
  // By thread: a scene's assemblies may fail in several threads at once.
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

// The effective parameters of a choice as the plugin sees them, for the time of create.
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
