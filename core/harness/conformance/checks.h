// The conformance checks: the contract that plugins of each kind must satisfy.
//
// Each check tests one promise of the contract, independently of the others: a plugin that breaks one promise fails one
// check, and checks that depend on it are skipped.
#pragma once

#include <string>
#include <vector>

#include "conformance/finding.h"
#include "conformance/subject.h"

namespace relign::conformance {

struct Check {
  const char* name;                // "stop"
  const char* promise;             // "returns promptly when stopped, at any request"
  std::vector<const char*> needs;  // checks that must not have failed or been skipped
  bool (*applies)(plugin_host::Kind);
  Finding (*look)(const Subject&);  // may throw Error, which fails the check
};

const std::vector<Check>& all_checks();  // in the order to run them
const Check* check_by_name(const std::string& name);

// library_checks.cpp
Finding check_library(const Subject& subject);
Finding check_symbols(const Subject& subject);
Finding check_interface(const Subject& subject);
Finding check_manifest(const Subject& subject);
Finding check_creates(const Subject& subject);
Finding check_floating_point(const Subject& subject);
Finding check_surroundings(const Subject& subject);
Finding check_stdout(const Subject& subject);
Finding check_heap(const Subject& subject);

// algorithm_checks.cpp
Finding check_runs(const Subject& subject);
Finding check_poses(const Subject& subject);
Finding check_stop(const Subject& subject);
Finding check_presets(const Subject& subject);
Finding check_dimensions(const Subject& subject);
Finding check_box(const Subject& subject);
Finding check_same_trace(const Subject& subject);
Finding check_merits(const Subject& subject);

// pretraining_checks.cpp
Finding check_prepared(const Subject& subject);

// scene_checks.cpp
Finding check_description(const Subject& subject);
Finding check_reference(const Subject& subject);
Finding check_same_pixels(const Subject& subject);
Finding check_truth(const Subject& subject);
Finding check_elements(const Subject& subject);
Finding check_optimum(const Subject& subject);
Finding check_further_scores(const Subject& subject);
Finding check_mtf(const Subject& subject);
Finding check_travel(const Subject& subject);
Finding check_stage(const Subject& subject);

// device_checks.cpp
Finding check_devices(const Subject& subject);

// noise_level_checks.cpp
Finding check_perturbations(const Subject& subject);
Finding check_same_draw(const Subject& subject);

}  // namespace relign::conformance
