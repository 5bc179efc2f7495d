// Frame of the program: global options, and the interface of the verbs.
//
// A verb is a function `void add_NAME(CLI::App& app, Context& context)` in verb_NAME.cpp. It adds its
// subcommand, which sets context.action when it is chosen. The action runs after all arguments have
// been parsed and returns an exit code. Verbs throw Error; only run_program turns errors into exit
// codes. Results (or their paths) go to stdout, everything else to stderr.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cli/exit_codes.h"
#include "cli/progress.h"
#include "plugin_host/catalog.h"
#include "plugin_host/confinement.h"
#include "plugin_host/objects.h"

namespace relign::cli {

class Context;

// One line of doctor.
struct Finding {
  std::string what;
  std::string state;  // "ok"; "note": works with limits; "wrong": something will not work
  std::string found;
};

struct NewNetworkPlugin {
  std::string name;  // of the folder's files
  std::string onnx;  // the network
  std::string scene;
  std::filesystem::path folder;  // is created; must not exist
};

// What components beside the harness add to its verbs. Empty functions and lists: not built.
struct Extensions {
  // The SVG of a scene's lens; empty for a scene without a lens file of ours.
  std::function<std::string(const plugin_host::Choice& scene)> draw_lens;
  // `plugin new --onnx`: writes the folder of an agent that follows a foreign network, or nothing. Throws Error:
  // bad_input if the network cannot be used or the folder exists; io.
  std::function<void(Context&, const NewNetworkPlugin&)> write_network_plugin;
  std::vector<std::function<Finding()>> findings;  // of doctor
};

class Context {
 public:
  Extensions extensions;
  bool json = false;                       // --json
  std::vector<std::string> plugin_paths;   // --plugin
  std::string progress_name = "auto";      // --progress
  std::vector<std::string> command_line;   // as typed; shown in messages on how to resume
  std::function<int()> action;             // set by the chosen verb
  std::string when_stopped;                // by add_action
  bool sandboxed = false;                  // --sandbox
  std::vector<std::string> sandbox_shown;  // --sandbox-show

  // Before the catalog is used. `results` is hidden from algorithms; it may be empty. Nothing without --sandbox. Throws
  // Error(bad_input) when this machine allows no sandbox.
  void start_sandbox(const std::filesystem::path& results);
  // The sandbox of algorithms; null without --sandbox. `memory_mb` is the limit of their processes; 0: 80 % of the
  // machine's memory.
  std::shared_ptr<const plugin_host::Sandbox> sandbox(unsigned memory_mb = 0) const;

  // All plugins: the installed ones and those of --plugin, scanned on first use. Throws Error(plugin_rejected).
  plugin_host::Catalog& catalog();

  // Threads, cache folder and log for plugin objects in this process.
  plugin_host::HostServices services(unsigned threads) const;

  ProgressMode progress_mode() const;
  std::string typed_command() const;

 private:
  plugin_host::Catalog catalog_;
  std::shared_ptr<plugin_host::Sandbox> sandbox_;
  bool scanned_ = false;
};

// The texts of a verb's help besides its options.
struct VerbText {
  const char* name;
  const char* summary;   // one sentence in the imperative
  const char* example;   // to copy and paste; several lines allowed
  const char* see_also;  // names of other verbs
};
CLI::App& add_verb(CLI::App& parent, const VerbText& text);

// Makes `run` the verb's action, and returns the arguments that it will get, for the verb's options to refer to.
// `when_stopped`, if given, is printed when `run` throws Error(stopped); a colon at its end announces the command as
// typed.
template <class Arguments>
Arguments& add_action(CLI::App& verb, Context& context, int (*run)(Context&, const Arguments&),
                      const char* when_stopped = "") {
  const auto arguments = std::make_shared<Arguments>();
  verb.callback([&context, arguments, run, when_stopped] {
    context.when_stopped = when_stopped;
    context.action = [&context, arguments, run] { return run(context, *arguments); };
  });
  return *arguments;
}

// --sandbox and --sandbox-show.
void add_sandbox_options(CLI::App& verb, Context& context);

// The day as 2026-11-24, UTC.
std::string today();

// For unsigned options: digits only, because CLI11 would convert "-3" to a huge number.
CLI::Validator whole_number();

// --rule, the recommendation rule of report and compare.
void add_rule_option(CLI::App& verb, std::string& rule);

// The verbs of the harness; add_scene and add_plugin return their verb for those below it.
void add_run(CLI::App& app, Context& context);
void add_worker(CLI::App& app, Context& context);  // hidden: worker processes of run
void add_try(CLI::App& app, Context& context);
void add_validate(CLI::App& app, Context& context);
void add_doctor(CLI::App& app, Context& context);
void add_completion(CLI::App& app, Context& context);
void add_explain(CLI::App& app, Context& context);
void add_list(CLI::App& app, Context& context);
void add_describe(CLI::App& app, Context& context);
void add_render(CLI::App& app, Context& context);
void add_report(CLI::App& app, Context& context);
void add_compare(CLI::App& app, Context& context);
void add_merge(CLI::App& app, Context& context);
void add_plan(CLI::App& app, Context& context);
void add_verify(CLI::App& app, Context& context);
void add_seal(CLI::App& app, Context& context);
void add_unseal(CLI::App& app, Context& context);
void add_scene(CLI::App& app, Context& context);
void add_plugin(CLI::App& app, Context& context);
void add_plugin_check(CLI::App& plugin, Context& context);    // below plugin
void add_plugin_prepare(CLI::App& plugin, Context& context);  // below plugin

// Those of the other components, which main.cpp adds if they are built.
void add_lens(CLI::App& app, Context& context);
void add_scene_new(CLI::App& scene, Context& context);  // below scene
void add_leaderboard(CLI::App& app, Context& context);
void add_submit(CLI::App& app, Context& context);
void add_slurm(CLI::App& app, Context& context);

// Parses the arguments, runs the verb and returns the exit code. `add_verbs` adds the verbs and sets
// context.extensions. Never throws.
int run_program(int argc, const char* const* argv, const std::function<void(CLI::App&, Context&)>& add_verbs);

// Writes to stdout. Throws Error(io) if that fails (full disk, closed pipe).
void print_result(const std::string& text);

// print_result for text with untrusted words in it, made printable (base/text.h). Not for JSON.
void print_text(const std::string& text);

// Writes "warning: TEXT" to stderr.
void print_warning(const std::string& text);

}  // namespace relign::cli
