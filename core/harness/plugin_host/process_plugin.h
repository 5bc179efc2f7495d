// A plugin that is a process of its own, before anyone knows of what kind: its start, the handshake, and
// messages (JSON objects, one a line; docs/process_plugins.md). Whatever the process does wrong becomes
// Error(plugin_failed) that names the plugin, what it did, how it ended and the end of its output.
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

// Seconds that a plugin may take, each with the environment variable that overrides it.
struct ProcessPatience {
  double handshake_seconds = 30;  // RELIGN_HANDSHAKE_SECONDS: from its start until it is ready for a trial
  double stop_seconds = 5;        // RELIGN_STOP_SECONDS: from the first "stop" until it says "done"
  double call_seconds = 60;       // RELIGN_CALL_SECONDS: for one answer of a scene or a noise level
  static ProcessPatience from_environment();
};

// Where relign_bench lies: ../share/relign-bench/python beside the program's own folder, in a build as after an
// installation. Empty: nowhere.
std::filesystem::path python_folder();

// What the command of a plugin gets besides the host's own environment, so that Python plugins find
// relign_bench and equal trials stay equal.
std::vector<std::string> process_environment();

class ProcessPlugin {
 public:
  // Starts the command, shakes hands and hands over the parameters. Throws Error: plugin_refused when it cannot be
  // started, plugin_failed when the handshake or create fails.
  ProcessPlugin(const Choice& choice, const HostServices& services);
  ~ProcessPlugin();  // says good-bye if all went well, and ends the process
  ProcessPlugin(const ProcessPlugin&) = delete;
  ProcessPlugin& operator=(const ProcessPlugin&) = delete;

  // `during` names in failures what was under way ("run"). The line ends with '\n'.
  void send_line(std::string_view line, const char* during);
  void send(const Json& message, const char* during);
  // The next message: an object whose "message" is a text. "failed" becomes an Error.
  Json receive(const char* during, Deadline deadline, const char* what_is_late);
  // Receives, and refuses every other message than `name`.
  Json expect(const char* name, const char* during, Deadline deadline);
  // Sends a request and waits for its answer `name`, or `otherwise` where it is given, as long as one call may take.
  Json ask_line(std::string_view line, const char* name, const char* during, const char* otherwise = nullptr);
  Json ask(const Json& request, const char* name, const char* during);

  // Members that a message must have; null is NaN in numbers. Otherwise they fail.
  const Json& object(const Json& message, const char* member, const char* during);
  double number(const Json& message, const char* member, const char* during);
  std::uint64_t bits(const Json& message, const char* member, const char* during);
  std::vector<double> numbers(const Json& message, const char* member, const char* during);

  enum class Why { rubbish, late, ended, said_so };  // what it sent, did not send, or reported
  // Ends the process and throws PluginEnded. From then on every request fails in the same words.
  [[noreturn]] void fail(const char* during, const std::string& sentence, Why why = Why::rubbish);

  const ProcessPatience& patience() const { return patience_; }
  int pixel_file() const { return child_->pixel_file(); }

 private:
  void shake_hands(const Manifest& manifest);
  void create(const Choice& choice, const HostServices& services);
  Json checked(Json message, const char* name, const char* otherwise, const char* during);
  template <class Fits>
  const Json& member(const Json& message, const char* name, const char* during, const char* what, Fits&& fits);

  std::string plugin_id_;
  ProcessPatience patience_;
  Deadline ready_by_;  // the end of handshake and create
  std::optional<ChildProcess> child_;
  std::string failure_, outcome_;  // empty: no message was wrong
};

// What went wrong with a child whose last receive gave `got`; empty for a line.
std::string got_text(ChildProcess::Got got, const std::string& what_is_late);
// ". Its process ended with exit status 1; the end of its output:\n  line\n  line"; the child was ended.
std::string ending_text(const ChildProcess& child);

}  // namespace relign::plugin_host
