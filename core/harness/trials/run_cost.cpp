#include "trials/run_cost.h"

#include <algorithm>
#include <barrier>
#include <chrono>
#include <exception>
#include <limits>
#include <thread>
#include <vector>

#include "base/seeds.h"
#include "trials/criterion_optimum.h"
#include "trials/instance.h"
#include "trials/own_optimum.h"

namespace relign::trials {
namespace {

constexpr double kNearby = 1e-3;  // shares of the travel

template <class Body>
double seconds_of(const Body& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The least of three: other programs only add to it. `body` gets a pose near `pose`, another one each time, and a seed:
// a scene may keep what it computed last.
template <class Body>
double least_seconds_of(std::vector<double> pose, const Body& body) {
  double least = std::numeric_limits<double>::infinity();
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    for (double& place : pose) place += place < 0.5 ? kNearby : -kNearby;
    least = std::min(least, seconds_of([&] { body(pose, seed); }));
  }
  return least;
}

RunCost measure(plugin_host::Scene& scene, const SceneFacts& facts, const Instance& instance,
                const Criteria& criteria) {
  RunCost cost;
  std::vector<float> pixels(std::size_t{facts.image_width} * facts.image_height);
  const std::vector<double>& nominal = facts.nominal_pose;
  plugin_host::MountedAssembly perfect = scene.mount("{}");
  perfect.capture(nominal, 1, pixels.data());  // warms the caches
  const auto begin = std::chrono::steady_clock::now();
  plugin_host::MountedAssembly lens = scene.mount(instance.perturbations.elements_json);
  std::vector<double> optimum = nominal;
  if (facts.truth)
    if (const auto own = own_optimum(lens, facts, instance.seed)) optimum = own->true_pose;
  const FieldValues design = design_fields(perfect, facts, criteria);
  cost.instance = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const std::vector<double>* const poses[] = {&optimum, &instance.perturbations.start};
  for (const std::vector<double>* pose : poses) {
    const auto capture = [&](const std::vector<double>& at, std::uint64_t seed) {
      lens.capture(at, seed, pixels.data());
    };
    cost.capture += least_seconds_of(*pose, capture) / std::size(poses);
    const auto score = [&](const std::vector<double>& at, std::uint64_t seed) { lens.noise_free_mse(at, seed); };
    if (facts.truth) cost.noise_free += least_seconds_of(*pose, score) / std::size(poses);
  }
  if (criteria.any()) {
    Judge judge(lens, facts, criteria, design, 1);
    for (const std::vector<double>* pose : poses)
      cost.judging += seconds_of([&] { judge.at(*pose, optimum); }) / std::size(poses);
    // The search itself takes minutes with diffraction.
    if (!criteria.field_mtf.empty()) cost.instance += kTypicalMeasurements * cost.judging;
  }
  return cost;
}

}  // namespace

RunCost measure_run_cost(const plugin_host::Choice& scene, const plugin_host::Choice& level, const Criteria& criteria,
                         const plugin_host::HostServices& services, unsigned workers) {
  constexpr unsigned kMostWorkers = 16;  // more would take memory and say no more
  workers = std::clamp(workers, 1U, kMostWorkers);
  std::vector<RunCost> costs(workers);
  std::vector<std::exception_ptr> failures(workers);
  std::barrier ready(static_cast<std::ptrdiff_t>(workers));
  const auto work = [&](unsigned worker) {
    bool waited = false;
    try {
      plugin_host::Scene own(scene, services);
      const SceneFacts facts = read_scene_facts(own.describe(), scene.id);
      plugin_host::NoiseLevel noise(level, services);
      const Instance instance = draw_instance(noise, facts, 1, SeedDomain::benchmark, worker);
      waited = true;
      ready.arrive_and_wait();
      costs[worker] = measure(own, facts, instance, criteria);
    } catch (...) {
      failures[worker] = std::current_exception();
      if (!waited) ready.arrive_and_drop();
    }
  };
  std::vector<std::thread> others;
  for (unsigned worker = 1; worker < workers; ++worker) others.emplace_back(work, worker);
  work(0);
  for (std::thread& other : others) other.join();
  RunCost mean;
  for (unsigned worker = 0; worker < workers; ++worker) {
    if (failures[worker]) std::rethrow_exception(failures[worker]);
    for (double RunCost::*part : {&RunCost::capture, &RunCost::noise_free, &RunCost::instance, &RunCost::judging})
      mean.*part += costs[worker].*part / workers;
  }
  return mean;
}

}  // namespace relign::trials
