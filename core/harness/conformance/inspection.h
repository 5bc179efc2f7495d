// Checks a plugin, with every check in a child process: a plugin that crashes, hangs or exits fails that check, and the
// other checks still run.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "conformance/finding.h"
#include "plugin_host/catalog.h"

namespace relign::conformance {

struct CheckResult {
  std::string check;
  std::string promise;
  Finding finding;
};

struct InspectionSetup {
  std::filesystem::path
      program;             // relign-bench; started as `program plugin check --one CHECK --report FD PATH`, with --scene
  double deadline_s = 60;  // wall-clock limit of one check
  std::optional<plugin_host::Choice> scene;  // check algorithms on it (trial_scene.h), else on synthetic merits
  std::string scene_option;                  // its --scene
  std::function<void(const CheckResult&)> on_result;  // may be empty
};

struct Inspection {
  std::string plugin;   // id, or the path when it was refused
  std::string kind;     // empty when refused
  std::string refused;  // why nothing could be checked; usually empty
  std::vector<CheckResult> results;

  bool passed() const;
  unsigned count(Verdict verdict) const;
};

Inspection inspect(const std::filesystem::path& plugin, const InspectionSetup& setup);

// The child's side: runs one check in this process and writes its finding to a file descriptor. The process ends when
// its parent does.
void run_one_check(const std::filesystem::path& plugin, const std::string& check, int report_descriptor,
                   const std::optional<plugin_host::Choice>& scene = {});

}  // namespace relign::conformance
