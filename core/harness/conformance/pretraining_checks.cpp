// Checks of algorithms with pretraining (relign.prepared/1).
#include <limits>

#include "base/error.h"
#include "conformance/checks.h"
#include "conformance/conduct.h"
#include "conformance/progress.h"
#include "conformance/watchdog.h"

namespace relign::conformance {

using plugin_host::Choice;

namespace {

constexpr std::uint32_t kAxes = 5;
constexpr double kCpu_s = 40, kWall_s = 400;  // for one trial, or for all sources

// Runs one trial with the data of `pretraining`. Returns the message of its failure, or an empty string.
std::string trial_with(const Subject& subject, FakePretraining pretraining, std::uint32_t axes,
                       const std::string& where) {
  const Choice& choice = subject.choice();
  at(where);
  Watchdog watchdog;
  watchdog.start(kCpu_s, kWall_s, failed(where + ", it does not end"));
  FakeSetup setup = setup_for(choice, axes, subject.scene.get());
  if (!subject.scene) setup.merit = noisy(setup.merit);
  setup.budget = 15;
  setup.pretraining = &pretraining;
  FakeTrial trial(setup);
  std::string failure;
  try {
    run_trial(choice, trial);
  } catch (const Error& error) {
    failure = error.what();
  }
  watchdog.stop();
  if (trial.refused) throw Error(ErrorKind::plugin_failed, where + ", it sends a non-finite pose");
  return failure;
}

std::string random_bytes(std::size_t count) {
  Random random(11, 3);
  std::string bytes(count, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random.bits());
  return bytes;
}

FakePretraining holding(std::string bytes) {
  FakePretraining pretraining;
  pretraining.bytes = std::move(bytes);
  return pretraining;
}

}  // namespace

Finding check_prepared(const Subject& subject) {
  const Choice& choice = subject.choice();
  if (subject.manifest->prepare.is_null()) return skipped("its manifest has no 'prepare'");
  Watchdog watchdog;
  watchdog.start(kCpu_s, kWall_s,
                 failed("its pretraining takes more than 40 s of processor time with 3 sources of 20 steps"));
  at("during pretraining");
  TrialScene* const scene = subject.scene.get();
  const FakePretraining learnt = prepare(choice, kAxes, {}, scene);
  if (!learnt.bytes) return failed("it saves no data during pretraining");
  if (prepare(choice, kAxes, {}, scene).bytes != learnt.bytes)
    return failed(
        "it saves different bytes when pretrained again on the same sources; draw random numbers from the seed of the "
        "task");
  at("during pretraining with merits that are NaN");
  try {
    prepare(
        choice, kAxes, [](const Pose&, std::uint32_t) { return std::numeric_limits<double>::quiet_NaN(); }, scene);
  } catch (const Error&) {  // it may report that it could not learn from these
  }
  watchdog.stop();

  const std::string whole = *learnt.bytes;
  if (const std::string failure = trial_with(subject, holding(whole), kAxes, "with its own data"); !failure.empty())
    return failed("it fails with its own data: " + failure);
  trial_with(subject, {}, kAxes, "without pretrained data");  // it may fail, if it needs them
  // The bytes come from a file: it must refuse malformed data with a message.
  const struct {
    const char* name;
    std::string bytes;
  } malformed[] = {{"no bytes", ""},
                   {"random bytes", random_bytes(4096)},
                   {"zeros", std::string(whole.size(), '\0')},
                   {"half of its own data", whole.substr(0, whole.size() / 2)}};
  for (const auto& one : malformed)
    if (trial_with(subject, holding(one.bytes), kAxes, std::string("with ") + one.name + " as pretrained data").empty())
      return failed(std::string("it accepts ") + one.name + " as pretrained data; check the result of load");
  for (std::size_t place = 0; place < 64 && place < whole.size(); ++place) {
    std::string damaged = whole;
    damaged[place * whole.size() / 64 % whole.size()] ^= '\x55';
    trial_with(subject, holding(damaged), kAxes, "with a damaged byte in its pretrained data");
  }
  if (!scene && trial_with(subject, holding(whole), kAxes - 1, "with data of another number of axes").empty())
    return failed("it accepts data of 5 axes for a trial of 4; save the number of axes with the data");
  return ok();
}

}  // namespace relign::conformance
