// Runs a plugin for checks, and watches the process state that plugins must not change.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "conformance/fake_trial.h"
#include "conformance/subject.h"
#include "plugin_host/packed.h"

namespace relign::conformance {

// A trial on a bowl-shaped merit, in the coordinates that this algorithm would get under a protocol; or on a scene,
// which has its own number of axes.
FakeSetup setup_for(const plugin_host::Choice& choice, std::uint32_t axes, TrialScene* scene = nullptr);

// `merit` with noise that depends only on the step.
std::function<double(const Pose&, std::uint32_t)> noisy(std::function<double(const Pose&, std::uint32_t)> merit);

// The data that an algorithm with pretraining (relign.prepared/1) saves on a few short sources, synthetic or of the
// scene; a function of choice, number of axes and scene. `merit`, if any, replaces that of the sources. Throws
// Error(plugin_failed).
FakePretraining prepare(const plugin_host::Choice& choice, std::uint32_t axes,
                        const std::function<double(const Pose&, std::uint32_t)>& merit = {},
                        TrialScene* scene = nullptr);

// Runs one trial in a new object, with services. Pretrains an algorithm that asks for it, unless the setup has data.
// Throws Error(plugin_failed).
void run_trial(const plugin_host::Choice& choice, FakeTrial& trial);

// Uses the plugin once: runs a trial, or draws, or captures and scores. Ignores reported failures, which other checks
// find.
void exercise(const plugin_host::Choice& choice, TrialScene* scene = nullptr);

// Environment variables and open file descriptors of this process.
class ProcessState {
 public:
  ProcessState();
  // A message per difference.
  std::vector<std::string> environment_changes() const;
  std::vector<std::string> descriptor_changes() const;

 private:
  std::map<std::string, std::string> variables_;
  std::map<int, std::string> descriptors_;
};

// Everything written to stdout while `work` runs, through any layer.
std::string stdout_of(const std::function<void()>& work);

using plugin_host::packed;

// Bytes allocated by malloc; 0 where unknown.
std::size_t heap_bytes();

}  // namespace relign::conformance
