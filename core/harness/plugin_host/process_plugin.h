// A plugin of any kind that runs as a process: start, handshake, and messages (JSON objects, one per line;
// docs/process_plugins.md). Every fault of the process becomes Error(plugin_failed) with the plugin's id, the fault,
// the exit status and the last lines of output.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/json_source.h"
#include "plugin_host/catalog.h"
#include "plugin_host/objects.h"
#include "plugin_host/process_child.h"

namespace relign::plugin_host {

// Time limits of a plugin, each with the environment variable that overrides it.
struct ProcessTimeouts {
  double handshake_seconds = 120;  // RELIGN_HANDSHAKE_SECONDS: from its start until it is ready for a trial
  double stop_seconds = 5;         // RELIGN_STOP_SECONDS: from the first "stop" until its "done"
  double call_seconds = 60;        // RELIGN_CALL_SECONDS: for one answer of a scene or a noise level
  static ProcessTimeouts from_environment();
};

// The folder of relign_bench: ../share/relign-bench/python relative to the program's folder, in builds and
// installations alike. Empty if it does not exist.
std::filesystem::path python_folder();

// Variables added to the environment of a plugin's command, so that Python plugins find relign_bench and equal trials
// stay equal.
std::vector<std::string> process_environment();

class ProcessPlugin {
 public:
  // Starts the command, performs the handshake and sends the parameters. Throws Error: plugin_rejected when it cannot
  // be started, plugin_failed when the handshake or create fails.
  ProcessPlugin(const Choice& choice, const HostServices& services);
  ~ProcessPlugin();  // sends "bye" unless it failed, and ends the process
  ProcessPlugin(const ProcessPlugin&) = delete;
  ProcessPlugin& operator=(const ProcessPlugin&) = delete;

  // `during` names the current activity in failures ("run"). The line ends with '\n'.
  void send_line(std::string_view line, const char* during);
  void send(const Json& message, const char* during);
  // Receives the next message: an object with a string "message". "failed" becomes an Error.
  Json receive(const char* during, Deadline deadline, const char* what_is_late);
  // Receives the message `name`, and fails for any other.
  Json expect(const char* name, const char* during, Deadline deadline);
  // Sends a request and waits for its answer `name` (or `otherwise`, unless null) within call_seconds.
  Json ask_line(std::string_view line, const char* name, const char* during, const char* otherwise = nullptr);
  Json ask(const Json& request, const char* name, const char* during);

  // Mandatory members of a message; fails without them. null is NaN in numbers.
  const Json& object(const Json& message, const char* member, const char* during);
  double number(const Json& message, const char* member, const char* during);
  std::uint64_t bits(const Json& message, const char* member, const char* during);
  std::vector<double> numbers(const Json& message, const char* member, const char* during);

  enum class Cause { malformed_message, timeout, ended, reported };
  // Ends the process and throws PluginEnded. Every later request fails with the same message.
  [[noreturn]] void fail(const char* during, const std::string& message, Cause cause = Cause::malformed_message);

  const ProcessTimeouts& timeouts() const { return timeouts_; }
  int pixel_file() const { return child_->pixel_file(); }
  void* take_pixels() { return child_->take_pixels(); }

 private:
  void shake_hands(const Manifest& manifest);
  void create(const Choice& choice, const HostServices& services);
  Json checked(Json message, const char* name, const char* otherwise, const char* during);
  template <class Fits>
  const Json& member(const Json& message, const char* name, const char* during, const char* what, Fits&& fits);

  std::string plugin_id_;
  ProcessTimeouts timeouts_;
  Deadline ready_by_;  // for handshake and create
  std::optional<ChildProcess> child_;
  std::string failure_, outcome_;  // empty: no failure so far
};

// Message on the fault of a child whose last receive returned `got`; empty for a line.
std::string got_text(ChildProcess::Got got, const std::string& what_is_late);
// "; its process ended with exit status 1; its last output:\n  line\n  line". Call it after child.end().
std::string ending_text(const ChildProcess& child);

}  // namespace relign::plugin_host
