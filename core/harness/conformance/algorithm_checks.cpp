// Checks of optimizers and agents, with all kinds of merits.
#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/text.h"
#include "conformance/checks.h"
#include "conformance/conduct.h"
#include "conformance/progress.h"
#include "conformance/trial_scene.h"
#include "conformance/watchdog.h"

namespace relign::conformance {

using plugin_host::Choice;

namespace {

constexpr double kStopCpu_s = 2;    // between RELIGN_STOP and the return of run
constexpr double kStopWall_s = 20;  // the same for work in another process
constexpr double kThinkCpu_s = 40;  // between two requests

const double kNaN = std::numeric_limits<double>::quiet_NaN();
const double kInfinity = std::numeric_limits<double>::infinity();

// Runs one trial. After the first RELIGN_STOP `watchdog` ends the process with `when_late`.
// Returns the failure that the plugin reports, or an empty string. A failure after a refused pose counts only if the
// caller asks for it, because the check "poses" covers that case.
std::string watched_trial(const Choice& choice, FakeTrial& trial, Watchdog& watchdog, const Finding& when_late) {
  bool told = false;
  trial.setup.on_stop = [&told, &watchdog, when_late] {
    if (!told) watchdog.start(kStopCpu_s, kStopWall_s, when_late);
    told = true;
  };
  watchdog.start(kThinkCpu_s, 10 * kThinkCpu_s, failed("it computes for more than 40 s without a request"));
  std::string failure;
  try {
    run_trial(choice, trial);
  } catch (const Error& error) {
    if (!trial.refused) failure = error.what();
  }
  watchdog.stop();
  trial.setup.on_stop = nullptr;
  return failure;
}

// The first difference between two trials, as text; empty when they are equal bit for bit.
std::string first_difference(const FakeTrial& one, const FakeTrial& other) {
  const std::size_t common = std::min(one.steps.size(), other.steps.size());
  for (std::size_t step = 0; step < common; ++step)
    if (one.steps[step].pose != other.steps[step].pose) return "at step " + std::to_string(step + 1);
  if (one.steps.size() != other.steps.size())
    return "in their number of steps (" + std::to_string(one.steps.size()) + " and " +
           std::to_string(other.steps.size()) + ")";
  bool same = one.recommendations.size() == other.recommendations.size();
  for (std::size_t i = 0; same && i < one.recommendations.size(); ++i)
    same = one.recommendations[i].pose == other.recommendations[i].pose &&
           one.recommendations[i].steps_made == other.recommendations[i].steps_made;
  return same ? "" : "in their recommendations";
}

// A scene has noise of its own.
FakeSetup noisy_setup(const Subject& subject, const Choice& choice, std::uint32_t axes, std::uint32_t budget) {
  FakeSetup setup = setup_for(choice, axes, subject.scene.get());
  if (!subject.scene) setup.merit = noisy(setup.merit);
  setup.budget = budget;
  return setup;
}

const Finding kStoppedLate = skipped("it does not return after RELIGN_STOP");

}  // namespace

Finding check_runs(const Subject& subject) {
  Watchdog watchdog;
  FakeTrial trial(noisy_setup(subject, subject.choice(), 5, 30));
  // The next two checks cover the time after RELIGN_STOP, and invalid poses.
  const std::string failure = watched_trial(subject.choice(), trial, watchdog, ok());
  return failure.empty() ? ok() : failed(failure);
}

Finding check_stop(const Subject& subject) {
  Watchdog watchdog;
  unsigned more_requests = 0;
  // A process starts again for each trial, and its imports may take seconds.
  const bool process = !subject.manifest->command.empty();
  constexpr std::uint32_t kLast = 40;
  for (std::uint32_t budget = 0; budget <= kLast; budget += process ? std::max(1U, budget / 2) : 1) {
    const std::string where = "stopped at request " + std::to_string(budget + 1);
    at(where);
    FakeTrial trial(noisy_setup(subject, subject.choice(), 5, budget));
    const std::string failure =
        watched_trial(subject.choice(), trial, watchdog,
                      failed(where + ", it did not return within " + shortest(kStopCpu_s) +
                             " s of processor time; run must return after RELIGN_STOP (an empty step in C++)"));
    if (!failure.empty()) return failed(where + ": " + failure);
    more_requests = std::max(more_requests, trial.requests_after_stop);
  }
  if (more_requests > 0)
    return warning("it requests up to " + std::to_string(more_requests) + " more steps after RELIGN_STOP");
  return ok();
}

Finding check_poses(const Subject& subject) {
  Watchdog watchdog;
  for (const bool with_noise : {true, false}) {
    FakeSetup setup = noisy_setup(subject, subject.choice(), 5, 60);
    if (!with_noise) setup.merit = setup_for(subject.choice(), 5, subject.scene.get()).merit;
    FakeTrial trial(setup);
    watched_trial(subject.choice(), trial, watchdog, kStoppedLate);
    if (trial.refused)
      return failed("after " + std::to_string(trial.steps.size()) +
                    " steps it sent an invalid pose (not finite, or the wrong number of axes), or requested step 0 "
                    "again too late");
  }
  return ok();
}

Finding check_presets(const Subject& subject) {
  Watchdog watchdog;
  for (const Choice& choice : subject.choices) {
    at("'" + choice.id + "'");
    FakeTrial trial(noisy_setup(subject, choice, 5, 20));
    const std::string failure =
        watched_trial(choice, trial, watchdog, failed("'" + choice.id + "' does not return after RELIGN_STOP"));
    if (!failure.empty()) return failed("'" + choice.id + "': " + failure);
    if (trial.refused) return failed("'" + choice.id + "' sent a pose that is not finite");
  }
  return ok();
}

Finding check_dimensions(const Subject& subject) {
  if (subject.scene)
    return skipped("it is checked with the " + std::to_string(subject.scene->axes()) + " axes" + " of '" +
                   subject.scene->name() + "'");
  Watchdog watchdog;
  std::vector<std::string> refused;
  for (const std::uint32_t axes : {1u, 2u, 5u, 6u, 10u}) {
    at("with " + std::to_string(axes) + " axes");
    FakeTrial trial(noisy_setup(subject, subject.choice(), axes, 60));
    const std::string failure = watched_trial(subject.choice(), trial, watchdog, kStoppedLate);
    if (trial.refused)
      return failed("with " + std::to_string(axes) + " axes it sent a pose that is not finite or has the wrong length");
    if (!failure.empty()) refused.push_back(std::to_string(axes) + " axes: " + failure);
  }
  // A plugin may refuse other numbers of axes, but must not crash or send invalid poses.
  if (!refused.empty() && !subject.manifest->check.empty())
    return skipped("made for different trials; it does not run with " + join(refused, "; "));
  return refused.empty() ? ok() : warning("it does not run with " + join(refused, "; "));
}

Finding check_box(const Subject& subject) {
  if (!(subject.manifest->observed_bits() & RELIGN_OBSERVES_BOX)) return skipped("it does not observe the box");
  Watchdog watchdog;
  for (const std::uint32_t axes : {2u, 5u}) {
    if (subject.scene && axes != 2U) break;  // which has a number of its own
    FakeTrial trial(noisy_setup(subject, subject.choice(), axes, 100));
    watched_trial(subject.choice(), trial, watchdog, kStoppedLate);
    const FakeSetup& setup = trial.setup;
    for (std::size_t step = 0; step < trial.steps.size(); ++step)
      for (std::size_t axis = 0; axis < setup.axes; ++axis) {
        const double value = trial.steps[step].pose[axis];
        if (value >= setup.lower[axis] && value <= setup.upper[axis]) continue;
        return warning("step " + std::to_string(step + 1) + " commands " + shortest(value) + " on axis " +
                       std::to_string(axis) + ", outside the box from " + shortest(setup.lower[axis]) + " to " +
                       shortest(setup.upper[axis]) + "; the host does not clip it");
      }
  }
  return ok();
}

Finding check_same_trace(const Subject& subject) {
  const Choice& choice = subject.choice();
  Watchdog watchdog;
  FakeSetup setup = noisy_setup(subject, choice, 5, 50);
  setup.seed = 77;
  FakeTrial alone(setup);
  watched_trial(choice, alone, watchdog, kStoppedLate);

  FakeSetup other_setup = noisy_setup(subject, choice, 2, 15);
  other_setup.seed = 78;
  FakeTrial between(other_setup);
  watched_trial(choice, between, watchdog, kStoppedLate);
  FakeTrial again(setup);
  watched_trial(choice, again, watchdog, kStoppedLate);
  if (const std::string where = first_difference(alone, again); !where.empty())
    return failed("two trials with the same seed and the same merits differ " + where +
                  "; draw every random number from the seed of the task, and keep no state in global variables");

  // The same trial, with another complete trial in the middle of it.
  FakeSetup interrupted_setup = setup;
  interrupted_setup.merit = [&, merit = setup.merit](const Pose& pose, std::uint32_t step) {
    if (step == 3) {
      FakeTrial inner(other_setup);
      try {
        run_trial(choice, inner);
      } catch (const Error&) {  // reported by another check
      }
    }
    return merit(pose, step);
  };
  FakeTrial interrupted(interrupted_setup);
  watched_trial(choice, interrupted, watchdog, kStoppedLate);
  if (const std::string where = first_difference(alone, interrupted); !where.empty())
    return failed("a trial changes when another one runs at the same time: they differ " + where +
                  "; keep no state in global variables");
  return ok();
}

Finding check_merits(const Subject& subject) {
  struct MeritKind {
    const char* name;
    std::function<double(const Pose&, std::uint32_t)> merit;
  };
  const std::vector<MeritKind> kinds = {
      {"constant", [](const Pose&, std::uint32_t) { return 0.03; }},
      {"zero", [](const Pose&, std::uint32_t) { return 0.0; }},
      {"NaN", [](const Pose&, std::uint32_t) { return kNaN; }},
      {"infinite", [](const Pose&, std::uint32_t) { return kInfinity; }},
      {"minus infinite", [](const Pose&, std::uint32_t) { return -kInfinity; }},
      {"huge", [](const Pose&, std::uint32_t step) { return step % 2 ? 1e300 : -1e300; }},
      {"out of range", [](const Pose& pose, std::uint32_t) { return -7 - pose[0]; }},
      {"NaN after step 0", [](const Pose&, std::uint32_t step) { return step == 0 ? 0.03 : kNaN; }},
      {"NaN now and then",
       [](const Pose& pose, std::uint32_t step) { return step % 3 == 1 ? kNaN : pose[0] * pose[0]; }},
  };
  Watchdog watchdog;
  for (const MeritKind& kind : kinds) {
    const std::string where = std::string("with merits that are ") + kind.name;
    at(where);
    FakeSetup setup = setup_for(subject.choice(), 5, subject.scene.get());
    setup.merit = kind.merit;
    setup.budget = 200;
    if (subject.scene) {  // captures stay those of the scene, and may take long
      setup.merit = [captured = setup_for(subject.choice(), 5, subject.scene.get()).merit, &kind](const Pose& pose,
                                                                                                  std::uint32_t step) {
        captured(pose, step);
        return kind.merit(pose, step);
      };
      setup.budget = 50;
    }
    FakeTrial trial(setup);
    const std::string failure =
        watched_trial(subject.choice(), trial, watchdog, failed(where + " it does not return after RELIGN_STOP"));
    if (!failure.empty()) return failed(where + " it fails: " + failure);
    if (trial.refused) return failed(where + " it sends non-finite poses");
  }
  return ok();
}

}  // namespace relign::conformance
