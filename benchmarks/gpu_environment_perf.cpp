// The part "environment" of relign-bench-gpu.
#include <cstdio>
#include <relign/random.hpp>

#include "base/machine.h"
#include "environment/batch.h"
#include "gpu/gpu.h"
#include "gpu_perf.h"

namespace relign::gpu_perf {
namespace {

using environment::Batch;

constexpr unsigned kEpisode = 200;  // moves, as in the paper

environment::BatchSetup setup_of(const std::filesystem::path& plugins, const Sizes& sizes) {
  plugin_host::Catalog catalog;
  catalog.scan(plugins);
  environment::BatchSetup setup;
  const Json pixels = sizes.pixels > 0 ? Json{{"pixels", sizes.pixels}} : Json::object();
  setup.scene = catalog.resolve_or_throw(plugin_host::Kind::scene, "relign_od", pixels);
  setup.level = catalog.resolve_or_throw(plugin_host::Kind::noise_level, "rho0.25");
  setup.slots = static_cast<unsigned>(sizes.batch);
  setup.threads = core_count();
  setup.on_gpu = true;
  return setup;
}

// Episodes that began at different times, so that in every step the same share of them ends.
class Episodes {
 public:
  explicit Episodes(Batch& batch) : batch_(batch), moves_(batch.slots() * batch.facts().axes.size()) {
    Random random(7);
    for (double& move : moves_) move = random.uniform(-0.02, 0.02);
    std::vector<Batch::Draw> draws;
    for (unsigned slot = 0; slot < batch.slots(); ++slot) {
      ages_.push_back(kEpisode - 1 - slot * kEpisode / batch.slots());
      all_.push_back(slot);
      draws.push_back({slot, SeedDomain::training, next_++});
    }
    batch.reset(draws);
  }

  // Starts the episodes that have ended, and moves the others. Returns the number of moves.
  std::size_t step() {
    std::vector<Batch::Draw> draws;
    std::vector<unsigned> moving;
    for (const unsigned slot : all_) {
      if (ages_[slot]++ < kEpisode) {
        moving.push_back(slot);
        continue;
      }
      ages_[slot] = 0;
      draws.push_back({slot, SeedDomain::training, next_++});
    }
    if (!draws.empty()) batch_.reset(draws);
    if (!moving.empty()) batch_.move_by(moving, moves_.data());
    return moving.size();
  }
  void score() { batch_.truths(all_); }

 private:
  Batch& batch_;
  std::vector<double> moves_;
  std::vector<unsigned> ages_, all_;
  std::uint64_t next_ = 0;
};

void print_rate(const char* what, const Sizes& sizes, const auto& step) {
  step();
  std::size_t moves = 0;
  const int calls = 10 * sizes.rounds;
  const double seconds = seconds_of([&] {
    for (int i = 0; i < calls; ++i) moves += step();
  });
  std::printf("| batch of %zu instances, no Python: step, %s | %.2f ms, %.0f steps per second |\n", sizes.batch, what,
              1e3 * seconds / calls, static_cast<double>(moves) / seconds);
}

}  // namespace

void print_environment(const std::filesystem::path& plugins, const Sizes& sizes) {
  Batch batch(setup_of(plugins, sizes));
  gpu::Gpu device;
  gpu::Buffer frames(device);
  frames.reserve(batch.slots() * batch.frame_pixels() * sizeof(float));
  batch.set_frames(frames.as<float>());
  Episodes episodes(batch);
  print_rate("resets included (episodes of 200 moves)", sizes, [&] { return episodes.step(); });
  print_rate("resets and noise-free RMSE of every step included", sizes, [&] {
    const std::size_t moves = episodes.step();
    episodes.score();
    return moves;
  });
}

}  // namespace relign::gpu_perf
