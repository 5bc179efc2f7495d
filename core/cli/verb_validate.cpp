// relign-bench validate: checks a suite and estimates its run time.
#include <chrono>

#include "base/seeds.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/progress.h"
#include "cli/shared_files.h"
#include "cli/workbench.h"
#include "records/specification.h"
#include "runner/criteria.h"
#include "runner/levels.h"
#include "runner/merits.h"
#include "runner/mtf_check.h"
#include "runner/stations.h"
#include "suites/suite.h"

namespace relign::cli {
namespace {

using Clock = std::chrono::steady_clock;

struct FrameCost {
  double capture_seconds = 0;
  double noise_free_seconds = 0;
};

// Times one capture and one noise-free RMSE at the nominal pose of a perfect lens, on one thread as in a worker. The
// first of each warms the caches and is not counted.
FrameCost measure(const LoadedScene& scene) {
  plugin_host::MountedAssembly assembly = scene.scene->mount("{}");
  std::vector<float> pixels(std::size_t{scene.facts.image_width} * scene.facts.image_height);
  FrameCost cost;
  for (int repeat = 0; repeat < 2; ++repeat) {
    const Clock::time_point start = Clock::now();
    assembly.capture(scene.facts.nominal_pose, 1, pixels.data());
    const Clock::time_point captured = Clock::now();
    assembly.noise_free_mse(scene.facts.nominal_pose, 1);
    cost.capture_seconds = std::chrono::duration<double>(captured - start).count();
    cost.noise_free_seconds = std::chrono::duration<double>(Clock::now() - captured).count();
  }
  return cost;
}

int validate(Context& context, const std::string& file) {
  context.start_sandbox("");
  const suites::Suite suite = suites::read_suite(suite_file(file), context.catalog());
  const std::size_t instances_per_algorithm = suite.levels.size() * suite.instances;
  std::size_t trials = 0, frames = 0;
  double seconds = 0;
  std::vector<trials::SceneFacts> facts;
  bool station = false;
  std::string mistakes, design_mtf;
  for (const suites::SceneEntry& entry : suite.scenes) {
    const LoadedScene scene = load_scene(entry.choice, context.services(1));
    facts.push_back(scene.facts);
    const records::Specification spec = records::specification_of(suite.spec, scene.facts.spec);
    constexpr double kAccuracy = 1e-4;  // of noise-free errors
    if (spec.rmse < kAccuracy)
      print_warning(entry.name + ": the specification requires an RMSE of " + significant(spec.rmse, 2) +
                    ", but noise-free errors are accurate only to 0.0001");
    try {
      const auto mtf = runner::check_mtf(suite, entry.name, *scene.scene, scene.facts);
      if (mtf && !spec.mtf_met_by(mtf->centre, mtf->corner))
        print_warning(entry.name + ": the lens as designed, at its nominal pose, misses the MTF of the specification");
      if (mtf)
        design_mtf += "MTF            " + printable(entry.name) + " as designed, at its nominal pose: centre " +
                      significant(mtf->centre, 3) + ", corner " + significant(mtf->corner, 3) +
                      (spec.diffraction ? " (with diffraction)" : "") + "\n";
      runner::check_criteria(suite, entry.name, *scene.scene, scene.facts);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::bad_input) throw;
      mistakes += (mistakes.empty() ? "" : "\n") + std::string(error.what());
    }
    station = station || scene.facts.owns_stage;
    // Does not move hardware.
    const FrameCost cost = scene.facts.owns_stage ? FrameCost{} : measure(scene);
    for (const suites::AlgorithmEntry& algorithm : suite.algorithms) {
      if (!runner::can_run_on(algorithm, scene.facts)) continue;
      const std::size_t captures = instances_per_algorithm * (std::size_t{algorithm.steps} + 1);
      trials += instances_per_algorithm;
      frames += captures;
      seconds += static_cast<double>(captures) * (cost.capture_seconds + 2 * cost.noise_free_seconds);
    }
  }
  if (!mistakes.empty()) throw Error(ErrorKind::bad_input, mistakes);
  runner::check_stations(suite, facts);
  runner::check_merits(suite, facts);
  runner::check_levels(suite, facts, [&context](const std::string&) { return context.services(1); });
  suites::Suite runnable = suite;
  for (const std::string& note : runner::leave_out_told_methods(runnable, facts)) print_warning(note);
  const unsigned cores = core_count();
  seconds /= cores;
  const Json expected = station ? Json() : Json(seconds);
  if (context.json) {
    const Json result = {{"suite", suite.name},
                         {"trials", trials},
                         {"frames", frames},
                         {"cores", cores},
                         {"expected_seconds", expected}};
    print_result(result.dump(2) + "\n");
    return kDone;
  }
  if (station) {
    print_result("suite          " + printable(suite.name) + "\ntrials         " + std::to_string(trials) +
                 "\nframes         " + std::to_string(frames) +
                 "\nexpected time  unknown: set by the hardware station (one trial at a time)\n");
    return kDone;
  }
  print_result("suite          " + printable(suite.name) + "\ntrials         " + std::to_string(trials) +
               "\nframes         " + std::to_string(frames) + "\nexpected time  at most " + duration_text(seconds) +
               " on " + std::to_string(cores) + (cores == 1 ? " core" : " cores") +
               " (from one capture and one noise-free RMSE timed now, two noise-free RMSEs per step; without the "
               "algorithms' own time)\n" +
               design_mtf);
  return kDone;
}

}  // namespace

void add_validate(CLI::App& app, Context& context) {
  CLI::App& verb =
      add_verb(app, {"validate", "Check a suite; print all its mistakes, or its trials, frames and expected run time.",
                     "relign-bench validate suites/quick.json", "run, list, describe"});
  auto file = std::make_shared<std::string>();
  verb.add_option("SUITE", *file, "suite file (JSON)")->required()->type_name("FILE");
  add_sandbox_options(verb, context);
  verb.callback([&context, file] { context.action = [&context, file] { return validate(context, *file); }; });
}

}  // namespace relign::cli
