// Imaging errors of one capture, all of them, drawn anew (randomise/COLUMNS).
#include <benchmark/benchmark.h>

#include <vector>

#include "imaging/capture_errors.h"
#include "imaging/scene_file.h"

namespace {

namespace imaging = relign::imaging;

void randomise(benchmark::State& state) {
  imaging::SceneChoices choices;
  choices.pixels = static_cast<int>(state.range(0));
  const imaging::SceneFile scene = imaging::read_scene_file(RELIGN_OD_SCENE, choices);
  constexpr float kWhite = 0.2F;
  imaging::CaptureErrors errors(imaging::read_imaging_errors(RELIGN_RANDOMISATION), scene.sensor, kWhite, 1);
  std::vector<float> pixels(scene.sensor.pixels());
  std::uint64_t seed = 0;
  for (auto _ : state) {
    std::fill(pixels.begin(), pixels.end(), kWhite);
    if (errors.draw(++seed)) errors.apply(pixels.data());
    benchmark::DoNotOptimize(pixels.data());
  }
}
BENCHMARK(randomise)->Arg(100)->Arg(200)->Unit(benchmark::kMicrosecond);

}  // namespace
