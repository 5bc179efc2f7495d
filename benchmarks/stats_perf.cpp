#include <benchmark/benchmark.h>

#include <relign/random.hpp>
#include <vector>

#include "statistics/bootstrap.h"
#include "statistics/signed_rank.h"

namespace {

using namespace relign::statistics;

std::vector<std::vector<double>> columns(std::size_t count, std::size_t instances) {
  relign::Random random(1);
  std::vector<std::vector<double>> result(count, std::vector<double>(instances));
  for (std::vector<double>& column : result) {
    for (double& value : column) value = random.normal();
  }
  return result;
}

// Bands of a report: 16 steps of 40 algorithms on 100 instances, including the resampling.
void report_bands(benchmark::State& state, const OrderStatistic& statistic) {
  const std::vector<std::vector<double>> values = columns(16 * 40, 100);
  for (auto _ : state) {
    const Resampling resampling(100, kResamples, 1);
    benchmark::DoNotOptimize(bands(resampling, values, statistic));
  }
}
BENCHMARK_CAPTURE(report_bands, iqm, OrderStatistic::iqm())->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(report_bands, median, OrderStatistic::median())->Unit(benchmark::kMillisecond);

// 100,000 instances: 1,000 resamples are kept, 10,000 are drawn again.
void large_bands(benchmark::State& state) {
  const std::vector<std::vector<double>> values = columns(4, 100'000);
  for (auto _ : state) {
    const Resampling resampling(100'000, static_cast<std::size_t>(state.range(0)), 1);
    benchmark::DoNotOptimize(bands(resampling, values, OrderStatistic::iqm()));
  }
}
BENCHMARK(large_bands)->Arg(1'000)->Arg(2'000)->Unit(benchmark::kMillisecond)->Iterations(1);

void signed_rank_test(benchmark::State& state) {
  const std::vector<double> differences = columns(1, static_cast<std::size_t>(state.range(0))).front();
  for (auto _ : state) benchmark::DoNotOptimize(signed_rank(differences));
}
BENCHMARK(signed_rank_test)->Arg(50)->Arg(100)->Unit(benchmark::kMicrosecond);

}  // namespace
