#include "conformance/checks.h"

namespace relign::conformance {

using plugin_host::Kind;

namespace {

bool any(Kind) { return true; }
bool algorithm(Kind kind) { return plugin_host::is_algorithm(kind); }
bool scene(Kind kind) { return kind == Kind::scene; }
bool level(Kind kind) { return kind == Kind::noise_level; }

}  // namespace

const char* verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::ok:
      return "ok";
    case Verdict::warning:
      return "warning";
    case Verdict::failed:
      return "failed";
    case Verdict::skipped:
      return "skipped";
  }
  return "";
}

std::optional<Verdict> verdict_from_name(const std::string& name) {
  for (const Verdict verdict : {Verdict::ok, Verdict::warning, Verdict::failed, Verdict::skipped})
    if (name == verdict_name(verdict)) return verdict;
  return std::nullopt;
}

const std::vector<Check>& all_checks() {
  static const std::vector<Check> checks = {
      {"library", "a complete shared library that loads", {}, any, check_library},
      {"symbols", "exports one symbol and no other", {"library"}, any, check_symbols},
      {"manifest",
       "the manifest beside the library is the one inside, byte for byte",
       {"library"},
       any,
       check_manifest},
      {"interface", "built for this version of the plugin interface", {"manifest"}, any, check_interface},
      {"creates", "defaults and every preset make an object", {"interface"}, any, check_creates},

      {"runs", "a trial of 30 steps ends without failure", {"creates"}, algorithm, check_runs},
      {"stop", "returns promptly when stopped, at whatever request", {"runs"}, algorithm, check_stop},
      {"poses", "every pose it sends is finite and complete", {"stop"}, algorithm, check_poses},
      {"presets", "every preset runs a trial", {"poses"}, algorithm, check_presets},
      {"dimensions", "runs with 1, 2, 5, 6 and 10 axes", {"poses"}, algorithm, check_dimensions},
      {"box", "stays inside the box it is given", {"poses"}, algorithm, check_box},
      {"same-trace", "same seed, same steps; also beside another trial", {"poses"}, algorithm, check_same_trace},
      {"merits",
       "survives merits that are NaN, infinite, constant, huge, out of range",
       {"poses"},
       algorithm,
       check_merits},
      {"prepared",
       "learns on source instances, again the same; trials survive without it, and refuse rubbish",
       {"poses"},
       algorithm,
       check_prepared},

      {"description", "describes itself completely", {"creates"}, scene, check_description},
      {"reference",
       "the reference image is complete, finite and always the same",
       {"description"},
       scene,
       check_reference},
      {"same-pixels", "same assembly, pose and seed, same pixels; all finite", {"reference"}, scene, check_same_pixels},
      {"truth", "truth is unbiased, with a standard error that holds", {"reference"}, scene, check_truth},
      {"optimum", "its own optimum is one, with the error that its truth tells there", {"truth"}, scene, check_optimum},
      {"mtf",
       "its MTF is a function of lens, pose and frequency; fine lines are not better than coarse ones",
       {"reference"},
       scene,
       check_mtf},
      {"elements", "refuses offsets of an element it does not have", {"description"}, scene, check_elements},
      {"travel", "survives poses at and beyond the ends of the travel", {"same-pixels"}, scene, check_travel},
      {"stage",
       "a scene that owns its stage starts, moves, stops at limits and captures",
       {"reference"},
       scene,
       check_stage},

      {"variances", "draws usable variances for 5 and 6 axes, with every preset", {"creates"}, level, check_variances},
      {"same-draw", "same seed, same draw; other seeds, other draws", {"variances"}, level, check_same_draw},

      {"floating-point",
       "leaves the floating-point mode as it was",
       {"creates", "runs", "stop"},
       any,
       check_floating_point},
      {"surroundings",
       "leaves folder, locale, signal handlers, environment and file descriptors",
       {"creates", "runs", "stop"},
       any,
       check_surroundings},
      {"stdout", "writes nothing to stdout", {"creates", "runs", "stop"}, any, check_stdout},
      {"heap",
       "needs no more memory from trial to trial",
       {"creates", "runs", "stop", "reference", "stage"},
       any,
       check_heap},
  };
  return checks;
}

const Check* check_by_name(const std::string& name) {
  for (const Check& check : all_checks())
    if (name == check.name) return &check;
  return nullptr;
}

}  // namespace relign::conformance
