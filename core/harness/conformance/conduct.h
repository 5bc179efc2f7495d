// What plugins must leave alone in the process they live in, and a way to make one work.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "conformance/fake_conversation.h"
#include "conformance/subject.h"

namespace relign::conformance {

// A trial over a bowl in the coordinates that a protocol would give this algorithm.
FakeSetup setup_for(const plugin_host::Choice& choice, std::uint32_t axes);

// The bowl with noise that depends on the step alone.
std::function<double(const Pose&, std::uint32_t)> noisy(std::function<double(const Pose&, std::uint32_t)> merit);

// What an algorithm that is prepared (relign.prepared/1) saves on a few short, made-up sources: the same for the same
// choice and number of axes. `merit` in the place of theirs, if there is one. Throws Error(plugin_failed).
FakePreparation prepare(const plugin_host::Choice& choice, std::uint32_t axes,
                        const std::function<double(const Pose&, std::uint32_t)>& merit = {});

// One trial in a fresh object, with services; an algorithm that is prepared is prepared before, unless the setup says
// with what. Throws Error(plugin_failed).
void run_trial(const plugin_host::Choice& choice, FakeConversation& conversation);

// Makes the plugin do once what it is for: a trial, a draw, a capture and a truth. What it reports as
// a failure is not thrown: other checks see to that.
void exercise(const plugin_host::Choice& choice);

// Environment variables and open file descriptors of this process.
class ProcessState {
 public:
  ProcessState();
  // A sentence per difference.
  std::vector<std::string> environment_changes() const;
  std::vector<std::string> descriptor_changes() const;

 private:
  std::map<std::string, std::string> variables_;
  std::map<int, std::string> descriptors_;
};

// What is written to stdout while `work` runs, through whatever layer.
std::string stdout_of(const std::function<void()>& work);

// Bytes that malloc has handed out; 0 where that is unknown.
std::size_t heap_bytes();

}  // namespace relign::conformance
