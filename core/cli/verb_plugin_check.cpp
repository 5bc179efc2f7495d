// relign-bench plugin check: runs the conformance checks on plugins.

#include <cstdio>
#include <filesystem>

#include "base/error.h"
#include "cli/app.h"
#include "cli/workbench.h"
#include "conformance/inspection.h"

namespace relign::cli {
namespace {

using conformance::CheckResult;
using conformance::Inspection;
using conformance::Verdict;

struct CheckArguments {
  std::vector<std::string> plugins;
  double deadline_s = 60;
  std::string scene;
  std::string one;    // in a child process: the check to run
  int report_fd = 1;  // in a child process: where to report
};

// Resolves a path, or the id of an installed plugin.
std::filesystem::path plugin_path(Context& context, const std::string& plugin) {
  if (std::filesystem::exists(plugin) || plugin.find('/') != std::string::npos) return plugin;
  for (const auto& known : context.catalog().plugins())
    if (known->id == plugin) return known->folder;
  return plugin;
}

std::string result_line(const CheckResult& result) {
  char columns[64];
  std::snprintf(columns, sizeof columns, "%-9s %-14s ",
                (std::string("[") + verdict_name(result.finding.verdict) + "]").c_str(), result.check.c_str());
  return columns + (result.finding.sentence.empty() ? result.promise : result.finding.sentence) + "\n";
}

std::string summary_line(const Inspection& inspection) {
  if (!inspection.refused.empty()) return "[refused] " + inspection.refused + "\n";
  std::string text = inspection.plugin + " (" + inspection.kind + "): ";
  text += std::to_string(inspection.count(Verdict::ok)) + " ok, " + std::to_string(inspection.count(Verdict::warning)) +
          " with a warning, " + std::to_string(inspection.count(Verdict::failed)) + " failed, " +
          std::to_string(inspection.count(Verdict::skipped)) + " skipped";
  return text + (inspection.passed() ? ": passed\n" : ": not passed\n");
}

Json to_json(const Inspection& inspection) {
  Json checks = Json::array();
  for (const CheckResult& result : inspection.results)
    checks.push_back({{"check", result.check},
                      {"promise", result.promise},
                      {"verdict", verdict_name(result.finding.verdict)},
                      {"reason", result.finding.sentence}});
  Json entry = {{"plugin", inspection.plugin}, {"passed", inspection.passed()}, {"checks", checks}};
  if (!inspection.kind.empty()) entry["kind"] = inspection.kind;
  if (!inspection.refused.empty()) entry["refused"] = inspection.refused;
  return entry;
}

std::optional<plugin_host::Choice> chosen_scene(Context& context, const CheckArguments& arguments) {
  if (arguments.scene.empty()) return std::nullopt;
  return named_choice(context.catalog(), plugin_host::Kind::scene, arguments.scene, "--scene");
}

int check(Context& context, const CheckArguments& arguments) {
  conformance::InspectionSetup setup;
  setup.program = std::filesystem::read_symlink("/proc/self/exe");
  setup.deadline_s = arguments.deadline_s;
  setup.scene = chosen_scene(context, arguments);
  setup.scene_option = arguments.scene;
  if (!context.json) setup.on_result = [](const CheckResult& result) { print_text(result_line(result)); };
  bool passed = true;
  Json all = Json::array();
  for (const std::string& plugin : arguments.plugins) {
    const Inspection inspection = conformance::inspect(plugin_path(context, plugin), setup);
    passed = passed && inspection.passed();
    all.push_back(to_json(inspection));
    if (!context.json) print_text(summary_line(inspection));
  }
  if (context.json) print_result(all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
  return passed ? kDone : kPluginRefused;
}

int check_one(Context& context, const CheckArguments& arguments) {
  conformance::run_one_check(arguments.plugins.front(), arguments.one, arguments.report_fd,
                             chosen_scene(context, arguments));
  return kDone;
}

}  // namespace

void add_plugin_check(CLI::App& plugin, Context& context) {
  CLI::App& verb = add_verb(plugin, {"check",
                                     "Run the conformance checks on plugins, each in its own process. Exit code 5 if a "
                                     "plugin is rejected or a check fails.",
                                     "relign-bench plugin check ./my_plugin", "list, describe, try"});
  auto arguments = std::make_shared<CheckArguments>();
  verb.add_option("PATH", arguments->plugins,
                  "plugin: folder, library, script or manifest, or the id of an installed plugin")
      ->required();
  verb.add_option(
          "--scene", arguments->scene,
          "check methods on this scene instead of synthetic trials: id, preset, path, or an object as in a suite")
      ->type_name("SCENE")
      ->check([](const std::string& scene) {
        return std::string(scene.empty() ? "is empty; expected an id, a preset or a path" : "");
      });
  verb.add_option("--deadline", arguments->deadline_s, "time limit of a check, seconds")
      ->type_name("SECONDS")
      ->check(CLI::Range(1.0, 86400.0))
      ->capture_default_str();
  verb.add_option("--one", arguments->one)->group("");
  verb.add_option("--report", arguments->report_fd)->group("");
  verb.callback([&context, arguments] {
    context.action = [&context, arguments] {
      return arguments->one.empty() ? check(context, *arguments) : check_one(context, *arguments);
    };
  });
}

}  // namespace relign::cli
