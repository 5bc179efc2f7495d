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
      {"symbols", "exports exactly one symbol", {"library"}, any, check_symbols},
      {"manifest",
       "the manifest beside the library equals the one inside, byte for byte",
       {"library"},
       any,
       check_manifest},
      {"interface", "built for this version of the plugin interface", {"manifest"}, any, check_interface},
      {"creates", "creates an object with defaults and every preset", {"interface"}, any, check_creates},

      {"runs", "runs a trial of 30 steps without failure", {"creates"}, algorithm, check_runs},
      {"stop", "returns promptly when stopped, at any request", {"runs"}, algorithm, check_stop},
      {"poses", "sends only finite and complete poses", {"stop"}, algorithm, check_poses},
      {"presets", "runs a trial with every preset", {"poses"}, algorithm, check_presets},
      {"dimensions", "runs with 1, 2, 5, 6 and 10 axes", {"poses"}, algorithm, check_dimensions},
      {"box", "stays inside the box", {"poses"}, algorithm, check_box},
      {"same-trace",
       "repeats its steps for the same seed, also beside another trial",
       {"poses"},
       algorithm,
       check_same_trace},
      {"merits",
       "survives merits that are NaN, infinite, constant, huge, out of range",
       {"poses"},
       algorithm,
       check_merits},
      {"prepared",
       "pretrains reproducibly; trials survive without the data, and refuse malformed data",
       {"poses"},
       algorithm,
       check_prepared},

      {"description",
       "has a complete description, and a design model that fits it",
       {"creates"},
       scene,
       check_description},
      {"reference", "has a complete, finite and reproducible reference image", {"description"}, scene, check_reference},
      {"same-pixels",
       "gives the same finite pixels for the same assembly, pose and seed",
       {"reference"},
       scene,
       check_same_pixels},
      {"truth", "gives an unbiased ground truth with a valid standard error", {"reference"}, scene, check_truth},
      {"optimum",
       "gives an optimum that no other pose beats, with the error of its ground truth",
       {"truth"},
       scene,
       check_optimum},
      {"devices",
       "draws devices whose optima, axes, quantities and readings mean what they say",
       {"optimum"},
       scene,
       check_devices},
      {"mtf",
       "gives an MTF that depends on lens, pose and frequency only, and does not rise for fine lines",
       {"reference"},
       scene,
       check_mtf},
      {"further-scores",
       "gives every further score that it declares, from 0, and of device, pose and seed only",
       {"truth"},
       scene,
       check_further_scores},
      {"elements", "refuses offsets of unknown elements", {"description"}, scene, check_elements},
      {"travel", "survives poses at and beyond the ends of the travel", {"same-pixels"}, scene, check_travel},
      {"stage", "as a station, starts, moves, stops at limits and captures", {"reference"}, scene, check_stage},

      {"perturbations",
       "draws usable perturbations for 5 and 6 axes, with every preset",
       {"creates"},
       level,
       check_perturbations},
      {"same-draw",
       "draws the same for the same seed, and differently for others",
       {"perturbations"},
       level,
       check_same_draw},

      {"floating-point",
       "does not change the floating-point mode",
       {"creates", "runs", "stop"},
       any,
       check_floating_point},
      {"surroundings",
       "does not change folder, locale, signal handlers, environment or file descriptors",
       {"creates", "runs", "stop"},
       any,
       check_surroundings},
      {"stdout", "writes nothing to stdout", {"creates", "runs", "stop"}, any, check_stdout},
      {"heap",
       "does not leak memory from trial to trial",
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
