// Checks a plugin, every check in a child process: a plugin that crashes, hangs or ends the process
// fails that check, and the others go on.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "conformance/finding.h"

namespace relign::conformance {

struct CheckResult {
  std::string check;
  std::string promise;
  Finding finding;
};

struct InspectionSetup {
  std::filesystem::path program;  // relign-bench; started as `program plugin check --one CHECK --report FD PATH`
  double deadline_s = 60;         // of one check, by the clock on the wall
  std::function<void(const CheckResult&)> on_result;  // may be empty
};

struct Inspection {
  std::string plugin;   // id, or the path when it was refused
  std::string kind;     // empty when refused
  std::string refused;  // why nothing could be checked; mostly empty
  std::vector<CheckResult> results;

  bool passed() const;
  unsigned count(Verdict verdict) const;
};

Inspection inspect(const std::filesystem::path& plugin, const InspectionSetup& setup);

// The child's side: one check in this process, its finding to that file descriptor. The process ends with
// its parent.
void run_one_check(const std::filesystem::path& plugin, const std::string& check, int report_descriptor);

}  // namespace relign::conformance
