// Overhead of a whole run: trials of an algorithm and a scene without computation, through workers, with all records.
// The counter "step", in seconds, is "harness_seconds" of times/ divided by the number of steps. The total time also
// includes the start of plugins and workers, pictures and the final sorting of files.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <filesystem>

#include "records/results_folder.h"
#include "runner/run.h"

namespace {

namespace fs = std::filesystem;
namespace runner = relign::runner;

void run(benchmark::State& state, bool processes) {
  const fs::path here = RELIGN_BENCHMARK_PLUGINS;
  relign::plugin_host::Catalog catalog;
  catalog.scan(RELIGN_PLUGINS);
  const std::string text = R"({"scenes": [")" + (here / "null_scene").string() + R"("], "noise_levels": ["rho0"],
    "algorithms": [")" + (here / "null_walker").string() +
                           R"("], "protocol": "blind", "instances": 300, "steps": 100})";
  const runner::PreparedPlan plan =
      runner::prepare(relign::suites::read_suite(relign::JsonSource::from_text(text, "null.json"), ".", catalog), {});
  const fs::path folder = fs::temp_directory_path() / ("relign-run-perf-" + std::to_string(::getpid()));
  runner::RunOptions options;
  options.results = folder;
  options.workers = 1;
  options.only = {{"algorithm", "null-walker"}};
  if (processes) options.worker_program = {RELIGN_PROGRAM, "worker"};
  double harness = 0, steps = 0;
  for (auto _ : state) {
    runner::run(plan, options);
    state.PauseTiming();
    for (const relign::records::TrialTimes& times : relign::records::read_times(folder)) {
      harness += times.harness_seconds;
      steps += static_cast<double>(times.simulation_seconds.size());
    }
    fs::remove_all(folder);
    state.ResumeTiming();
  }
  state.counters["step"] = harness / steps;
}
BENCHMARK_CAPTURE(run, threads, false)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(run, processes, true)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
