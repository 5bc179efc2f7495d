#include "environment/batch.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "plugin_host/packed.h"
#include "trials/own_optimum.h"
#include "trials/stage.h"

namespace relign::environment {
namespace {

struct Slot {
  std::optional<plugin_host::MountedAssembly> assembly;
  std::optional<trials::StageMotion> stage;
  Batch::State state;
  bool searched = false;
  std::optional<plugin_host::MountedAssembly::Optimum> optimum;
};

}  // namespace

struct Batch::Implementation {
  explicit Implementation(BatchSetup given)
      : setup(std::move(given)),
        parallel(setup.on_gpu ? 1 : std::max(1U, std::min(setup.threads, setup.slots))),
        level(setup.level, services()) {
    if (setup.slots == 0) throw Error(ErrorKind::bad_input, "expected at least 1 slot, found 0");
    // A process scene answers one thread at a time, so that each thread needs a process.
    for (unsigned i = 0; i < parallel.threads(); ++i)
      scenes.push_back(std::make_unique<plugin_host::Scene>(setup.scene, services()));
    facts = trials::facts_of(*scenes.front(), setup.scene.id);
    if (facts.owns_stage)
      throw Error(ErrorKind::bad_input,
                  "scene '" + setup.scene.id + "' is a station, whose lens cannot be drawn; use a simulated scene");
    pixels = std::size_t{facts.image_width} * facts.image_height;
    if (setup.on_gpu) {
      if (const std::string problem = scenes.front()->open_gpu(); !problem.empty())
        throw Error(ErrorKind::bad_input, problem);
    } else {
      host_frames.assign(pixels * setup.slots, 0.0F);
      frames = host_frames.data();
    }
    reference = plugin_host::packed(scenes.front()->reference());
    slots.resize(setup.slots);
  }
  ~Implementation() { slots.clear(); }  // lenses must be destroyed before their scenes
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  plugin_host::HostServices services() const {
    plugin_host::HostServices services;
    // Frames in parallel scale better than threads within a frame. One scene object serves a GPU, with all threads.
    services.threads = setup.on_gpu ? std::max(1U, setup.threads) : 1;
    services.cache_folder = setup.cache_folder;
    services.log = [notify = setup.on_message](int importance, const std::string& message) {
      if (notify && importance >= RELIGN_LOG_WARNING) notify(message);
    };
    return services;
  }

  void check(const std::vector<unsigned>& named, bool must_hold_a_lens) const {
    std::vector<bool> seen(slots.size(), false);
    for (const unsigned slot : named) {
      if (slot >= slots.size())
        throw Error(ErrorKind::bad_input,
                    "found slot " + std::to_string(slot) + "; expected 0 to " + std::to_string(slots.size() - 1));
      if (seen[slot]) throw Error(ErrorKind::bad_input, "slot " + std::to_string(slot) + " is given twice");
      seen[slot] = true;
      if (must_hold_a_lens && !slots[slot].assembly)
        throw Error(ErrorKind::bad_input, "slot " + std::to_string(slot) + " has no lens yet; reset it first");
    }
  }

  // Checks slots and poses. Returns the number of axes.
  std::size_t check_poses(const std::vector<unsigned>& named, const double* true_poses) const {
    check(named, true);
    const std::size_t axes = facts.axes.size();
    if (!std::all_of(true_poses, true_poses + axes * named.size(),
                     [](double value) { return value >= 0 && value <= 1; }))
      throw Error(ErrorKind::bad_input, "a true pose is outside [0, 1]");
    return axes;
  }

  // Calls body(index into `named`) for each. Each slot uses one scene object throughout, and each scene object is used
  // by one thread at a time.
  template <class Body>
  void for_each(const std::vector<unsigned>& named, const Body& body) {
    parallel.for_each(static_cast<int>(scenes.size()), [&](int scene, unsigned) {
      for (std::size_t k = 0; k < named.size(); ++k)
        if (named[k] % scenes.size() == static_cast<std::size_t>(scene)) body(k);
    });
  }

  // Calls body(index into `named`) for each, as for_each does, and captures each slot.
  template <class Body>
  void for_each_captured(const std::vector<unsigned>& named, const Body& body) {
    if (frames == nullptr)
      throw Error(ErrorKind::bad_input, "the batch has no memory of the GPU for its frames; call set_frames first");
    for_each(named, [&](std::size_t k) {
      body(k);
      Slot& slot = slots[named[k]];
      slot.state.true_pose = slot.stage->true_pose();
      slot.state.commanded_pose = slot.stage->reached_pose();
      slot.stage->wait((facts.machine_time.exposure_ms + facts.machine_time.readout_ms) / 1000);
      if (setup.on_gpu) return;
      float* frame = frames + pixels * named[k];
      slot.assembly->capture(slot.state.true_pose, capture_seed(slot), frame);
      slot.state.measured_error = facts.measured(frame, reference.data());
    });
    if (!setup.on_gpu) return;
    plugin_host::Scene::Batch batch;
    for (const unsigned number : named)
      add(batch, number, slots[number].state.true_pose.data(), capture_seed(slots[number]));
    const std::vector<double> rmse = scenes.front()->capture_batch(batch, named, frames);
    for (std::size_t k = 0; k < named.size(); ++k) slots[named[k]].state.measured_error = rmse[k];
  }

  static std::uint64_t capture_seed(const Slot& slot) {
    return frame_seed(slot.state.instance.seed, slot.state.step, FrameStream::capture);
  }

  // Calls render(lens, pose, index into `named`) for each. Throws if it returns false: the scene has no `what`.
  template <class Render>
  void render(const std::vector<unsigned>& named, const double* true_poses, const char* what, const Render& render) {
    const std::size_t axes = check_poses(named, true_poses);
    std::atomic<bool> offered{true};
    for_each(named, [&](std::size_t k) {
      const std::vector<double> pose(true_poses + axes * k, true_poses + axes * (k + 1));
      if (!render(*slots[named[k]].assembly, pose, k)) offered = false;
    });
    if (!offered) throw Error(ErrorKind::bad_input, "scene '" + setup.scene.id + "' has no " + what);
  }

  // To a batch of the GPU.
  void add(plugin_host::Scene::Batch& batch, unsigned number, const double* true_pose, std::uint64_t seed) {
    batch.assemblies.push_back(&*slots[number].assembly);
    batch.true_poses.insert(batch.true_poses.end(), true_pose, true_pose + facts.axes.size());
    batch.seeds.push_back(seed);
  }

  BatchSetup setup;
  Parallel parallel;
  std::vector<std::unique_ptr<plugin_host::Scene>> scenes;
  plugin_host::NoiseLevel level;
  trials::SceneFacts facts;
  std::size_t pixels = 0;
  std::vector<float> reference;
  std::vector<float> host_frames;  // empty on a GPU
  float* frames = nullptr;
  std::vector<Slot> slots;
};

Batch::Batch(BatchSetup setup) : implementation_(std::make_unique<Implementation>(std::move(setup))) {}
Batch::~Batch() = default;

const trials::SceneFacts& Batch::facts() const { return implementation_->facts; }
unsigned Batch::slots() const { return implementation_->setup.slots; }
unsigned Batch::threads() const {
  return implementation_->setup.on_gpu ? implementation_->services().threads : implementation_->parallel.threads();
}
std::size_t Batch::frame_pixels() const { return implementation_->pixels; }
const std::vector<float>& Batch::reference() const { return implementation_->reference; }
const Batch::State& Batch::state(unsigned slot) const {
  implementation_->check({slot}, true);
  return implementation_->slots[slot].state;
}
const float* Batch::frames() const { return implementation_->frames; }
void Batch::set_frames(float* memory) { implementation_->frames = memory; }

void Batch::reset(const std::vector<Draw>& draws) {
  Implementation& in = *implementation_;
  std::vector<unsigned> named;
  for (const Draw& draw : draws) named.push_back(draw.slot);
  in.check(named, false);
  // The noise level is one object, used only by this thread.
  std::vector<trials::Instance> instances;
  for (const Draw& draw : draws)
    instances.push_back(trials::draw_instance(in.level, in.facts, in.setup.suite_seed, draw.domain, draw.number));
  in.for_each_captured(named, [&](std::size_t k) {
    Slot& slot = in.slots[named[k]];
    slot.assembly.reset();
    slot.searched = false;
    slot.state = State();
    slot.state.instance = std::move(instances[k]);
    const trials::Perturbations& drawn = slot.state.instance.perturbations;
    slot.assembly.emplace(in.scenes[named[k] % in.scenes.size()]->mount(drawn.elements_json));
    slot.stage.emplace(in.facts, slot.state.instance, drawn.start, in.setup.limits);
  });
}

void Batch::move_by(const std::vector<unsigned>& slots, const double* moves) {
  Implementation& in = *implementation_;
  in.check(slots, true);
  const std::size_t axes = in.facts.axes.size();
  if (!std::all_of(moves, moves + axes * slots.size(), [](double value) { return std::isfinite(value); }))
    throw Error(ErrorKind::bad_input, "a move has a non-finite number");
  in.for_each_captured(slots, [&](std::size_t k) {
    Slot& slot = in.slots[slots[k]];
    const trials::StageMotion::Arrival arrival =
        slot.stage->move_by(std::vector<double>(moves + axes * k, moves + axes * (k + 1)));
    slot.state.limits_low = arrival.limits_low;
    slot.state.limits_high = arrival.limits_high;
    ++slot.state.step;
  });
}

void Batch::capture_at(const std::vector<unsigned>& slots, const double* true_poses, const std::uint64_t* seeds,
                       float* pixels) {
  Implementation& in = *implementation_;
  const std::size_t axes = in.check_poses(slots, true_poses);
  if (in.setup.on_gpu) {
    plugin_host::Scene::Batch batch;
    std::vector<std::uint32_t> places;
    for (std::size_t k = 0; k < slots.size(); ++k) {
      in.add(batch, slots[k], true_poses + axes * k, seeds[k]);
      places.push_back(static_cast<std::uint32_t>(k));
    }
    in.scenes.front()->capture_batch(batch, places, pixels);
    return;
  }
  in.for_each(slots, [&](std::size_t k) {
    in.slots[slots[k]].assembly->capture(std::vector<double>(true_poses + axes * k, true_poses + axes * (k + 1)),
                                         seeds[k], pixels + in.pixels * k);
  });
}

void Batch::render_at(const std::vector<unsigned>& slots, const double* true_poses, float* pixels) {
  Implementation& in = *implementation_;
  in.render(slots, true_poses, "noise-free images; average captures instead",
            [&](auto& lens, const auto& pose, auto k) { return lens.render_noise_free(pose, pixels + in.pixels * k); });
}

void Batch::render_slopes_at(const std::vector<unsigned>& slots, const double* true_poses, const std::uint64_t* seeds,
                             std::uint32_t samples, float* pixels) {
  Implementation& in = *implementation_;
  in.render(slots, true_poses, "derivatives of images", [&](auto& lens, const auto& pose, auto k) {
    return lens.render_slopes(pose, seeds[k], samples, {}, pixels + (pose.size() + 1) * in.pixels * k);
  });
}

void Batch::fields_at(const std::vector<unsigned>& slots, const double* true_poses, double lp_per_mm, double* values) {
  Implementation& in = *implementation_;
  if (!(lp_per_mm > 0 && std::isfinite(lp_per_mm)))
    throw Error(ErrorKind::bad_input, "found lp_per_mm " + std::to_string(lp_per_mm) + "; expected a positive number");
  std::vector<std::uint32_t> which(in.facts.fields.size());
  std::iota(which.begin(), which.end(), 0U);
  in.render(slots, true_poses, "fields whose MTF can be computed", [&](auto& lens, const auto& pose, auto k) {
    double* row = values + 4 * which.size() * k;
    const auto fields = lens.fields(pose, lp_per_mm, which);
    for (const auto& field : fields)
      for (const double value : {field.x_px, field.y_px, field.tangential, field.sagittal}) *row++ = value;
    return !fields.empty();
  });
}

std::vector<trials::Truth> Batch::truths(const std::vector<unsigned>& slots) {
  std::vector<double> true_poses;
  std::vector<unsigned> steps;
  for (const unsigned slot : slots) {
    const State& now = state(slot);
    true_poses.insert(true_poses.end(), now.true_pose.begin(), now.true_pose.end());
    steps.push_back(now.step);
  }
  return truths_at(slots, true_poses.data(), steps);
}

std::vector<trials::Truth> Batch::truths_at(const std::vector<unsigned>& slots, const double* true_poses,
                                            const std::vector<unsigned>& steps) {
  Implementation& in = *implementation_;
  in.check(slots, true);
  const std::size_t axes = in.facts.axes.size();
  const auto seed_of = [&](std::size_t k) {
    return frame_seed(in.slots[slots[k]].state.instance.seed, steps[k], FrameStream::truth_commanded);
  };
  std::vector<trials::Truth> truths(slots.size());
  if (in.setup.on_gpu) {
    plugin_host::Scene::Batch batch;
    for (std::size_t k = 0; k < slots.size(); ++k) in.add(batch, slots[k], true_poses + axes * k, seed_of(k));
    const auto values = in.scenes.front()->mse_batch(batch);
    for (std::size_t k = 0; k < slots.size(); ++k) truths[k] = {values[k].mse, values[k].standard_error};
    return truths;
  }
  in.for_each(slots, [&](std::size_t k) {
    const auto value = in.slots[slots[k]].assembly->noise_free_mse(
        std::vector<double>(true_poses + axes * k, true_poses + axes * (k + 1)), seed_of(k));
    truths[k] = {value.mse, value.standard_error};
  });
  return truths;
}

std::vector<std::optional<plugin_host::MountedAssembly::Optimum>> Batch::optima(const std::vector<unsigned>& slots) {
  Implementation& in = *implementation_;
  in.check(slots, true);
  std::vector<std::optional<plugin_host::MountedAssembly::Optimum>> optima(slots.size());
  in.for_each(slots, [&](std::size_t k) {
    Slot& slot = in.slots[slots[k]];
    if (!slot.searched)
      slot.optimum = trials::own_optimum(*slot.assembly, in.facts,
                                         frame_seed(slot.state.instance.seed, 0, FrameStream::own_optimum));
    slot.searched = true;
    optima[k] = slot.optimum;
  });
  return optima;
}

}  // namespace relign::environment
