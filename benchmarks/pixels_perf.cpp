#include <benchmark/benchmark.h>

#include <vector>

#include "images/score.h"

namespace {

void rmse(benchmark::State& state) {
  std::vector<float> a(40000, 0.1F), b(40000, 0.2F);
  for (auto _ : state) benchmark::DoNotOptimize(relign::images::rmse(a.data(), b.data(), a.size()));
}
BENCHMARK(rmse)->Name("rmse_200x200")->Unit(benchmark::kMicrosecond);

}  // namespace
