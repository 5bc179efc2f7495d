#include "conformance/conduct.h"

#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <system_error>

#include "base/error.h"
#include "base/json_source.h"
#include "conformance/fake_services.h"
#include "conformance/synthetic.h"
#include "conformance/trial_scene.h"
#include "plugin_host/training.h"

extern char** environ;

namespace relign::conformance {

using plugin_host::Choice;
using plugin_host::Kind;

namespace {

// Enough for pretraining, few enough for a check.
constexpr unsigned kMaxSources = 3;
constexpr unsigned kMaxSourceSteps = 20;

}  // namespace

FakeSetup setup_for(const Choice& choice, std::uint32_t axes, TrialScene* scene) {
  FakeSetup setup;
  setup.axes = axes;
  setup.observes = choice.plugin->observed_bits();
  const bool stage_coordinates = setup.observes & RELIGN_OBSERVES_START;
  setup.scene = scene;
  if (scene) {
    scene->fill(setup, stage_coordinates);
    return setup;
  }
  setup.start.assign(axes, 0.0);
  for (std::uint32_t axis = 0; axis < axes; ++axis) setup.start[axis] = stage_coordinates ? 0.35 + 0.03 * axis : 0.0;
  setup.lower.assign(axes, stage_coordinates ? 0.2 : -0.5);
  setup.upper.assign(axes, stage_coordinates ? 0.8 : 0.5);
  Pose optimum = setup.start;
  for (std::uint32_t axis = 0; axis < axes; ++axis) optimum[axis] += axis % 2 ? -0.11 : 0.13;
  setup.merit = [optimum](const Pose& pose, std::uint32_t) { return bowl(pose, optimum); };
  setup.image_side = kPictureSide;
  setup.paint = paint_edge;
  return setup;
}

std::function<double(const Pose&, std::uint32_t)> noisy(std::function<double(const Pose&, std::uint32_t)> merit) {
  return [merit = std::move(merit)](const Pose& pose, std::uint32_t step) {
    return merit(pose, step) + 0.002 * Random(99, step).normal();
  };
}

FakePretraining prepare(const Choice& choice, std::uint32_t axes,
                        const std::function<double(const Pose&, std::uint32_t)>& merit, TrialScene* scene) {
  const auto wanted = plugin_host::pretraining(*choice.plugin, choice.parameters);
  FakePretraining pretraining;
  if (!wanted) return pretraining;
  pretraining.active = true;
  pretraining.sources = std::min(wanted->sources, kMaxSources);
  for (; pretraining.source < pretraining.sources; ++pretraining.source) {
    FakeSetup setup = setup_for(choice, axes, scene);
    Pose optimum = setup.start;
    Random random(pretraining.source, 7);
    for (double& coordinate : optimum) coordinate += 0.2 * (random.uniform() - 0.5);
    if (merit)
      setup.merit = merit;
    else if (!scene)
      setup.merit = noisy([optimum](const Pose& pose, std::uint32_t) { return bowl(pose, optimum); });
    setup.seed = pretraining.source;
    setup.budget = std::min(wanted->steps, kMaxSourceSteps);
    setup.pretraining = &pretraining;
    FakeTrial trial(setup);
    run_trial(choice, trial);
  }
  pretraining.active = false;
  return pretraining;
}

namespace {

// Pretrained data, cached in this process by choice and number of axes: most checks run many trials, some concurrently.
FakePretraining cached_pretraining(const Choice& choice, std::uint32_t axes, TrialScene* scene) {
  static std::mutex mutex;
  const std::lock_guard<std::mutex> hold(mutex);
  static std::map<std::string, FakePretraining> known;
  const std::string key = std::to_string(axes) + choice.identity;
  if (!known.count(key)) known[key] = prepare(choice, axes, {}, scene);
  return known[key];
}

}  // namespace

void run_trial(const Choice& choice, FakeTrial& trial) {
  FakePretraining pretraining;
  const bool own = trial.setup.pretraining != nullptr;
  if (!own && !choice.plugin->prepare.is_null()) {
    pretraining = cached_pretraining(choice, trial.setup.axes, trial.setup.scene);
    trial.setup.pretraining = &pretraining;
  }
  const FakeServices services(choice, trial);
  plugin_host::Algorithm algorithm(choice, check_services());
  struct Restore {
    FakeSetup& setup;
    bool own;
    ~Restore() {
      if (!own) setup.pretraining = nullptr;
    }
  } restore{trial.setup, own};
  algorithm.run(trial.handle());
}

namespace {

void exercise_scene(const Choice& choice) {
  plugin_host::Scene scene(choice, check_services());
  const Json description = valid_json(scene.describe());
  const relign_image reference = scene.reference();
  std::vector<float> pixels(std::size_t{reference.width} * reference.height);
  if (scene.offers_stage()) {
    scene.begin(1);
    scene.move_by(std::vector<double>(description.at("axes").size(), 0.01));
    scene.capture(pixels.data());
    return;
  }
  plugin_host::MountedAssembly assembly = scene.mount("{}");
  const auto pose = description.at("nominal_pose").get<std::vector<double>>();
  assembly.capture(pose, 1, pixels.data());
  assembly.noise_free_mse(pose, 2);
}

}  // namespace

void exercise(const Choice& choice, TrialScene* scene) {
  try {
    if (plugin_host::is_algorithm(choice.plugin->kind)) {
      FakeSetup setup = setup_for(choice, 5, scene);
      setup.budget = 40;
      FakeTrial trial(setup);
      run_trial(choice, trial);
    } else if (choice.plugin->kind == Kind::noise_level) {
      plugin_host::NoiseLevel(choice, check_services()).draw(1, synthetic_scene(5));
    } else {
      exercise_scene(choice);
    }
  } catch (const std::exception&) {  // reported by another check
  }
}

ProcessState::ProcessState() {
  for (char** entry = environ; entry && *entry; ++entry) {
    const std::string line = *entry;
    variables_[line.substr(0, line.find('='))] = line;
  }
  for (int number = 0; number < 1024; ++number) {
    if (::fcntl(number, F_GETFD) < 0) continue;
    std::error_code error;
    descriptors_[number] = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(number), error).string();
  }
}

std::vector<std::string> ProcessState::environment_changes() const {
  const ProcessState now;
  std::vector<std::string> messages;
  for (const auto& [name, line] : variables_) {
    const auto found = now.variables_.find(name);
    if (found == now.variables_.end())
      messages.push_back("the environment variable " + name + " was removed");
    else if (found->second != line)
      messages.push_back("the environment variable " + name + " was changed");
  }
  for (const auto& [name, line] : now.variables_)
    if (!variables_.count(name)) messages.push_back("the environment variable " + name + " was set");
  return messages;
}

std::vector<std::string> ProcessState::descriptor_changes() const {
  const ProcessState now;
  std::vector<std::string> messages;
  for (const auto& [number, target] : descriptors_)
    if (!now.descriptors_.count(number))
      messages.push_back("the file descriptor " + std::to_string(number) + " was closed");
  for (const auto& [number, target] : now.descriptors_)
    if (!descriptors_.count(number))
      messages.push_back("the file descriptor " + std::to_string(number) + " was left open (" + target + ")");
  return messages;
}

std::string stdout_of(const std::function<void()>& work) {
  std::fflush(stdout);
  const int saved = ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 10);
  const int written = ::memfd_create("stdout", MFD_CLOEXEC);
  if (saved < 0 || written < 0 || ::dup2(written, STDOUT_FILENO) < 0)
    throw Error(ErrorKind::io, "cannot capture stdout: " + std::generic_category().message(errno));
  work();
  std::cout.flush();
  std::fflush(stdout);
  ::dup2(saved, STDOUT_FILENO);
  ::close(saved);
  std::string text(4096, '\0');
  const ssize_t count = ::pread(written, text.data(), text.size(), 0);
  ::close(written);
  text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return text;
}

std::size_t heap_bytes() {
  const struct mallinfo2 info = ::mallinfo2();
  return info.uordblks + info.hblkhd;
}

}  // namespace relign::conformance
