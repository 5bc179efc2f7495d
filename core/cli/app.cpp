#include "cli/app.h"

#include <cstdio>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <new>

#include "base/error.h"
#include "base/fault.h"
#include "base/files.h"
#include "base/machine.h"
#include "base/own_command.h"
#include "base/shell_words.h"
#include "base/text.h"
#include "cli/argument_fault.h"
#include "cli/help.h"
#include "cli/interrupt.h"

namespace relign::cli {
namespace {

void print_error(const std::string& text) {
  const bool colours = stderr_has_colours();
  std::fprintf(stderr, "%serror:%s %s\n", colours ? "\033[31m" : "", colours ? "\033[0m" : "", printable(text).c_str());
}

int exit_code(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::bad_input:
    case ErrorKind::io:
      return kBadInput;
    case ErrorKind::plugin_rejected:
      return kPluginRefused;
    case ErrorKind::stopped:
      return stop_exit_code();
    case ErrorKind::plugin_failed:
    case ErrorKind::internal:
      break;
  }
  return kInternal;
}

// The chosen verb, or the program itself.
const CLI::App* chosen_verb(const CLI::App& app) {
  const CLI::App* verb = &app;
  while (!verb->get_subcommands().empty()) verb = verb->get_subcommands().front();
  return verb;
}

// CLI11 reports only that an argument was not expected; this adds the most similar option or verb.
std::string explain_parse_error(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* verb = chosen_verb(app);
  std::vector<std::string> extras = app.remaining(true);
  for (const std::string& extra : extras) {
    std::vector<std::string> known;
    if (!extra.empty() && extra.front() == '-') {
      const std::string name = extra.substr(0, extra.find('='));
      for (const CLI::App* level = verb; level != nullptr; level = level->get_parent())
        for (const CLI::Option* option : level->get_options())
          for (const std::string& known_name : option->get_lnames()) known.push_back("--" + known_name);
      const std::string nearest = nearest_name(name, known);
      return "unknown option '" + name + "'" + (nearest.empty() ? "" : "; did you mean '" + nearest + "'?");
    }
    const auto verbs = verb->get_subcommands([](const CLI::App*) { return true; });
    if (verbs.empty()) return "unexpected argument '" + extra + "'";
    for (const CLI::App* known_verb : verbs)
      if (!known_verb->get_group().empty()) known.push_back(known_verb->get_name());
    return "unknown verb '" + extra + "'" + suggestion(extra, known);
  }
  return argument_fault(error.what());
}

std::string help_hint(const CLI::App& app) {
  std::string arguments = "--help";
  for (const CLI::App* level = chosen_verb(app); level->get_parent() != nullptr; level = level->get_parent())
    arguments = level->get_name() + " " + arguments;
  return "See: " + own_command(arguments);
}

void add_global_options(CLI::App& app, Context& context) {
  app.add_flag("--json", context.json, "print the result as JSON");
  app.add_option("--plugin", context.plugin_paths,
                 "also load this plugin: folder, library, script or manifest; repeatable")
      ->type_name("PATH")
      ->allow_extra_args(false);
  app.add_option("--progress", context.progress_name,
                 "progress on stderr: auto (a status line on a terminal, otherwise plain), plain (a line every 10 s), "
                 "json (one object per line) or none")
      ->type_name("MODE")
      ->check(CLI::IsMember({"auto", "plain", "json", "none"}))
      ->capture_default_str();
  app.set_version_flag("--version",
                       std::string("relign-bench " RELIGN_VERSION) + " (plugin interface " +
                           std::to_string(RELIGN_ABI_MAJOR) + "." + std::to_string(RELIGN_ABI_MINOR) + ")",
                       "print the version");
}

std::string exit_codes_text() {
  std::vector<std::string> codes;
  for (const Explanation& entry : kExitCodes)
    codes.push_back(std::string(entry.code) + " " + std::string(entry.meaning));
  return wrapped("Exit codes: " + join(codes, "; ") + ". What to do next: relign-bench explain CODE", 0);
}

// Errors of relative paths do not state this cause.
std::string with_deleted_folder(const std::string& text, bool keep = true) {
  std::error_code code;
  const bool found = !std::filesystem::current_path(code).empty();
  if (found || code != std::errc::no_such_file_or_directory) return text;
  return (keep ? text + "\n" : "") + "the working folder was deleted; change to a folder that exists";
}

int run_action(Context& context) {
  try {
    return context.action();
  } catch (const Error& error) {
    if (error.kind() == ErrorKind::stopped && !context.when_stopped.empty())
      std::fprintf(stderr, "%s\n%s", context.when_stopped.c_str(),
                   context.when_stopped.back() == ':' ? ("  " + context.typed_command() + "\n").c_str() : "");
    else
      print_error(with_deleted_folder(error.what()));
    return exit_code(error.kind());
  } catch (const std::filesystem::filesystem_error& error) {
    print_error(with_deleted_folder(fault_text(error), !error.path1().empty()));
    return kBadInput;
  } catch (const std::bad_alloc& error) {
    print_error(fault_text(error));
    return kInternal;
  } catch (const std::exception& error) {
    print_error("internal error: " + fault_text(error));
    return kInternal;
  }
}

}  // namespace

plugin_host::Catalog& Context::catalog() {
  if (!scanned_) {
    for (const std::filesystem::path& root : plugin_host::Catalog::default_roots()) catalog_.scan(root);
    for (const std::string& path : plugin_paths) catalog_.add(path);
    for (const std::string& refused : catalog_.refused()) print_warning(refused);
    scanned_ = true;
  }
  return catalog_;
}

plugin_host::HostServices Context::services(unsigned threads) const {
  plugin_host::HostServices services;
  services.threads = threads;
  services.cache_folder = relign::cache_folder();
  services.sandbox = sandbox();
  services.log = [](int level, const std::string& message) {
    if (level >= RELIGN_LOG_WARNING) print_warning(message);
  };
  return services;
}

void Context::start_sandbox(const std::filesystem::path& results) {
  if (!sandboxed && sandbox_shown.empty()) return;
  if (!sandboxed) throw Error(ErrorKind::bad_input, "--sandbox-show: requires --sandbox");
  if (const std::string& problem = plugin_host::sandbox_problem(); !problem.empty())
    throw Error(ErrorKind::bad_input, "--sandbox: not possible on this machine: " + problem);
  sandbox_ = std::make_shared<plugin_host::Sandbox>();
  for (const std::string& path : sandbox_shown) {
    if (!std::filesystem::exists(path))
      throw Error(ErrorKind::bad_input, "--sandbox-show: '" + path + "' does not exist");
    sandbox_->shown.push_back(std::filesystem::absolute(path).lexically_normal());
  }
  for (const std::filesystem::path& path : {results, relign::cache_folder()})
    if (!path.empty()) sandbox_->hidden.push_back(std::filesystem::absolute(path).lexically_normal());
  sandbox_ = std::make_shared<plugin_host::Sandbox>(*sandbox(0));
  catalog_.use_sandbox(sandbox_);
}

std::shared_ptr<const plugin_host::Sandbox> Context::sandbox(unsigned memory_mb) const {
  if (!sandbox_) return nullptr;
  constexpr double kShareOfMachine = 0.8;
  plugin_host::Sandbox with_limit = *sandbox_;
  with_limit.memory_bytes =
      memory_mb > 0 ? std::size_t{memory_mb} * 1'000'000
                    : static_cast<std::size_t>(kShareOfMachine * static_cast<double>(usable_memory_bytes()));
  return std::make_shared<const plugin_host::Sandbox>(std::move(with_limit));
}

void add_sandbox_options(CLI::App& verb, Context& context) {
  verb.add_flag("--sandbox", context.sandboxed,
                "confine algorithms: no network, no view of other files and processes, limits");
  verb.add_option("--sandbox-show", context.sandbox_shown,
                  "with --sandbox: one more file or folder that algorithms may read; repeatable")
      ->type_name("PATH")
      ->allow_extra_args(false);
}

ProgressMode Context::progress_mode() const {
  return progress_mode_from_name(progress_name).value_or(ProgressMode::plain);
}

std::string Context::typed_command() const {
  std::vector<std::string> words;
  for (const std::string& word : command_line) words.push_back(shell_quoted(word));
  return join(words, " ");
}

CLI::App& add_verb(CLI::App& parent, const VerbText& text) {
  CLI::App* verb = parent.add_subcommand(text.name, text.summary);
  verb->fallthrough();  // global options may follow the verb
  std::string footer = "Example:\n  ";
  for (const char letter : std::string(text.example))
    footer += letter == '\n' ? std::string("\n  ") : std::string(1, letter);
  verb->footer(footer + "\n\nSee also: " + text.see_also);
  return *verb;
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &utc);
  return text;
}

CLI::Validator whole_number() {
  return CLI::Validator(
      [](const std::string& text) {
        const bool digits = !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
        return digits && text.size() <= 19 ? std::string() : "'" + text + "' must be a non-negative integer";
      },
      "");
}

void add_rule_option(CLI::App& verb, std::string& rule) {
  verb.add_option(
          "--rule", rule,
          "recommendation rule: own (the pose that the method recommends), best (pose of its lowest measured error) "
          "or current (its latest pose) [default: the analysis plan's, else own]")
      ->type_name("RULE:{own,best,current}")
      ->check(CLI::IsMember({"own", "best", "current"}));
}

// For a user who typed no verb.
std::string first_steps() {
  const std::pair<const char*, const char*> steps[] = {
      {"run suites/quick.json", "compare five methods on one lens, and write a report"},
      {"try imitation --noise-level rho0.25", "watch one alignment, step by step"},
      {"list", "see lenses, noise levels and methods"},
      {"scene new LENS.zmx -o my-lens --sensor 1920x1280@3", "make a scene from a Zemax or CODE V file"},
      {"plugin new my-method --kind optimizer --lang python", "start a method of your own"}};
  std::string text = "Expected a verb. Five things to do next:\n";
  for (const auto& [command, purpose] : steps)
    text += std::string("\n  ") + own_command(command) + "\n      " + purpose + "\n";
  return text + "\nAll verbs: " + own_command("--help") + "\nThis machine: " + own_command("doctor") + "\n";
}

int run_program(int argc, const char* const* argv, const std::function<void(CLI::App&, Context&)>& add_verbs) {
  Context context;
  context.command_line.assign(argv, argv + argc);
  if (argc > 0) set_own_program(argv[0]);
  CLI::App app(
      "Benchmark active alignment of lenses: every method runs on the same seeded instances and is scored by its "
      "noise-free error.",
      "relign-bench");
  try {
    app.formatter(help_formatter());
    app.set_help_flag("-h,--help", "print this help");
    app.require_subcommand(0, 1);
    app.footer(
        "Example:\n  relign-bench run suites/quick.json\n\n"
        "Help of a verb: relign-bench VERB --help\n\n" +
        exit_codes_text());
    add_global_options(app, context);
    add_verbs(app, context);
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    context.action = [&] {
      print_result(app.help());
      return kDone;
    };
  } catch (const CLI::CallForVersion& version) {
    context.action = [text = std::string(version.what())] {
      print_result(text + "\n");
      return kDone;
    };
  } catch (const CLI::ParseError& error) {
    print_error(explain_parse_error(app, error));
    std::fprintf(stderr, "%s\n", help_hint(app).c_str());
    return kBadInput;
  } catch (const std::exception& error) {
    print_error("internal error: " + fault_text(error));
    return kInternal;
  }
  if (!context.action) {
    std::fputs(first_steps().c_str(), stderr);
    return kBadInput;
  }
  return run_action(context);
}

void print_result(const std::string& text) {
  errno = 0;
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw Error(ErrorKind::io, std::string("cannot write the result to stdout: ") + std::strerror(errno));
}

void print_text(const std::string& text) { print_result(printable(text)); }

void print_warning(const std::string& text) {
  const bool colours = stderr_has_colours();
  std::fprintf(stderr, "%swarning:%s %s\n", colours ? "\033[33m" : "", colours ? "\033[0m" : "",
               printable(text).c_str());
}

}  // namespace relign::cli
