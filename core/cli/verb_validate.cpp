// relign-bench validate: checks a suite and estimates its run time.
#include "base/error.h"
#include "base/own_command.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/expected_time.h"
#include "cli/interrupt.h"
#include "cli/shared_files.h"
#include "cli/spec_outlook.h"
#include "cli/workbench.h"
#include "records/specification.h"
#include "report/spec_words.h"
#include "runner/levels.h"
#include "runner/merits.h"
#include "runner/spec_check.h"
#include "runner/stations.h"
#include "suites/suite.h"

namespace relign::cli {
namespace {

struct ValidateArguments {
  std::string file;
  unsigned lenses = 0;
};

// How many lenses of each scene and noise level can meet the specification.
Json outlooks(Context& context, const suites::Suite& suite, unsigned lenses, std::string& text) {
  Json all = Json::array();
  for (const suites::SceneEntry& entry : suite.scenes) {
    const LoadedScene scene = load_scene(entry.choice, context.services(core_count()));
    const records::Specification spec = records::specification_of(suite.spec, scene.facts.spec, scene.facts.score);
    if (scene.facts.owns_stage || !scene.facts.truth) continue;
    if (!trials::limits_reachable(spec)) {
      text += "can meet spec  " + printable(entry.name) + ": not judged, without a limit of RMSE or MTF\n";
      continue;
    }
    for (const suites::LevelEntry& level : suite.levels) {
      const SpecOutlook outlook = spec_outlook(context, scene, level.choice, spec, lenses);
      if (!outlook.warning.empty()) print_warning(entry.name + ", " + level.name + ": " + outlook.warning);
      text += "can meet spec  " + printable(entry.name) + ", " + printable(level.name) + ": " + outlook.lenses +
              " at their best poses\n";
      all.push_back(outlook_json(outlook));
      all.back().update({{"scene", entry.name}, {"noise_level", level.name}});
    }
  }
  return all;
}

int checked(Context& context, const ValidateArguments& arguments) {
  context.start_sandbox("");
  if (arguments.lenses > 0) watch_for_stop();
  const suites::Suite suite = suites::read_suite(suite_file(arguments.file), context.catalog());
  std::vector<trials::SceneFacts> facts;
  std::string mistakes, design_mtf, memory;
  Json memory_bytes = Json::object();
  for (const suites::SceneEntry& entry : suite.scenes) {
    const LoadedScene scene = load_scene(entry.choice, context.services(1));
    facts.push_back(scene.facts);
    memory_bytes[entry.name] = scene.memory_bytes;
    if (scene.memory_bytes > 0)
      memory += "memory         " + printable(entry.name) + ": " +
                significant(static_cast<double>(scene.memory_bytes) / 1e6, 3) +
                " MB in each worker, measured now while this process created the scene\n";
    const records::Specification spec = records::specification_of(suite.spec, scene.facts.spec, scene.facts.score);
    const SceneScore& score = scene.facts.score;
    if (spec.score < score.resolution)
      print_warning(entry.name + ": the specification requires " + (score.squared ? "an " : "") + score.name + " of " +
                    significant(spec.score, 2) + score.suffix() + ", but noise-free errors are accurate only to " +
                    shortest(score.resolution) + score.suffix());
    for (const std::string& warning : runner::mtf_warnings(spec, scene.facts))
      print_warning(entry.name + ": " + warning);
    try {
      const auto mtf = runner::check_mtf(suite, entry.name, *scene.scene, scene.facts);
      if (mtf && !spec.mtf_met_by(mtf->centre, mtf->corner))
        print_warning(entry.name + ": the lens as designed, at its nominal pose, misses the MTF of the specification");
      if (mtf)
        design_mtf += "MTF            " + printable(entry.name) + " as designed, at its nominal pose: centre " +
                      significant(mtf->centre, 3) + ", corner " + significant(mtf->corner, 3) +
                      (spec.diffraction ? " (with diffraction)" : " (geometric, no diffraction)") + "\n";
      if (spec.field_mtf.lp_per_mm > 0)
        design_mtf += "MTF by field   " + printable(entry.name) + " at " + significant(spec.field_mtf.lp_per_mm, 3) +
                      " lp/mm: " + report::mtf_kind_words(spec) + "\n";
      runner::check_criteria(suite, entry.name, *scene.scene, scene.facts);
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::bad_input) throw;
      mistakes += (mistakes.empty() ? "" : "\n") + std::string(error.what());
    }
  }
  if (!mistakes.empty()) throw Error(ErrorKind::bad_input, mistakes);
  runner::check_units(suite, facts);
  runner::check_stations(suite, facts);
  runner::check_merits(suite, facts);
  for (const std::string& note :
       runner::check_levels(suite, facts, [&context](const std::string&) { return context.services(1); }))
    print_warning(note);
  const ExpectedTime expected = expected_time(context, suite, facts, core_count());
  suites::Suite runnable = suite;
  for (const std::string& note : runner::leave_out_told_methods(runnable, facts)) print_warning(note);
  std::string possible;
  const Json can_meet = arguments.lenses > 0 ? outlooks(context, suite, arguments.lenses, possible) : Json::array();
  if (context.json) {
    Json result = {{"suite", suite.name},
                   {"trials", expected.trials},
                   {"frames", expected.frames},
                   {"cores", expected.workers},
                   {"expected_seconds", expected.seconds ? Json(*expected.seconds) : Json()},
                   {"scene_memory_bytes", memory_bytes}};
    if (arguments.lenses > 0) result["can_meet_spec"] = can_meet;
    print_result(result.dump(2) + "\n");
    return kDone;
  }
  print_result("suite          " + printable(suite.name) + "\ntrials         " + std::to_string(expected.trials) +
               "\nframes         " + std::to_string(expected.frames) + "\nexpected time  " + expected.text() + "\n" +
               (expected.seconds ? memory + design_mtf : "") + possible);
  return kDone;
}

int validate(Context& context, const ValidateArguments& arguments) {
  try {
    return checked(context, arguments);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::plugin_failed) throw;
    throw Error(ErrorKind::plugin_rejected,
                std::string(error.what()) + "; '" + own_command("plugin check PLUGIN") + "' checks it alone");
  }
}

}  // namespace

void add_validate(CLI::App& app, Context& context) {
  CLI::App& verb =
      add_verb(app, {"validate", "Check a suite: print all its mistakes, or its trials, frames and expected run time.",
                     "relign-bench validate suites/quick.json", "run, list, describe"});
  ValidateArguments& given = add_action(verb, context, validate);
  verb.add_option("SUITE", given.file, kSuiteHelp)->required()->type_name("SUITE");
  verb.add_option("--lenses", given.lenses,
                  "also draw this many lenses from each noise level, at most 1,000, none of them an instance of the "
                  "suite, and count those that can meet the specification at their best poses")
      ->type_name("COUNT")
      ->check(CLI::Range(0U, 1000U));
  add_sandbox_options(verb, context);
}

}  // namespace relign::cli
