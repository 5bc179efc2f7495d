// The program's frame: global options, and how a verb plugs in.
//
// A verb is one function `void add_NAME(CLI::App& app, Context& context)` in verb_NAME.cpp: it adds
// its subcommand and, when that is chosen, sets context.action. The action runs after all arguments
// were read and returns an exit code. Verbs throw Error; only run_program turns errors into exit
// codes. stdout carries the result or its path, stderr everything else.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "cli/exit_codes.h"
#include "cli/progress.h"
#include "plugin_host/catalog.h"
#include "plugin_host/objects.h"

namespace relign::cli {

class Context {
 public:
  bool json = false;                      // --json
  std::vector<std::string> plugin_paths;  // --plugin
  std::string progress_name = "auto";     // --progress
  std::vector<std::string> command_line;  // as typed, for "the same command goes on"
  std::function<int()> action;            // set by the chosen verb

  // All plugins: scanned on first use, then those of --plugin. Throws Error(plugin_refused).
  plugin_host::Catalog& catalog();

  // Threads, cache and log for objects that live in this process.
  plugin_host::HostServices services(unsigned threads) const;

  ProgressMode progress_mode() const;
  std::string typed_command() const;

 private:
  plugin_host::Catalog catalog_;
  bool scanned_ = false;
};

// What a verb's help says besides its options.
struct VerbText {
  const char* name;
  const char* summary;   // one sentence
  const char* example;   // to copy and paste; several lines allowed
  const char* see_also;  // names of other verbs
};
CLI::App& add_verb(CLI::App& parent, const VerbText& text);

// For options that are numbers or seeds: digits only, so that "-3" does not become a huge number.
CLI::Validator whole_number();

void add_run(CLI::App& app, Context& context);
void add_worker(CLI::App& app, Context& context);  // hidden: what run starts
void add_try(CLI::App& app, Context& context);
void add_validate(CLI::App& app, Context& context);
void add_doctor(CLI::App& app, Context& context);
void add_completion(CLI::App& app, Context& context);
void add_list(CLI::App& app, Context& context);
void add_describe(CLI::App& app, Context& context);
void add_render(CLI::App& app, Context& context);
void add_report(CLI::App& app, Context& context);
void add_compare(CLI::App& app, Context& context);
void add_merge(CLI::App& app, Context& context);
void add_plan(CLI::App& app, Context& context);
void add_slurm(CLI::App& app, Context& context);
void add_slurm_status(CLI::App& slurm, Context& context);  // below slurm
void add_verify(CLI::App& app, Context& context);
void add_lens(CLI::App& app, Context& context);
void add_lens_mesh(CLI::App& lens, Context& context);  // below lens
void add_lens_draw(CLI::App& lens, Context& context);  // below lens
void add_scene(CLI::App& app, Context& context);
void add_scene_new(CLI::App& scene, Context& context);  // below scene
void add_plugin(CLI::App& app, Context& context);
void add_plugin_check(CLI::App& plugin, Context& context);    // below plugin
void add_plugin_prepare(CLI::App& plugin, Context& context);  // below plugin

// Reads the arguments, runs the verb, returns the exit code. Never throws.
int run_program(int argc, const char* const* argv);

// Text for stdout; throws Error(io) when it cannot be written (a full disk, a closed pipe).
void print_result(const std::string& text);

// The same for people, with words of strangers in it: printable (base/text.h). JSON stays what it is.
void print_text(const std::string& text);

// A line for stderr: "warning: ...".
void print_warning(const std::string& text);

}  // namespace relign::cli
