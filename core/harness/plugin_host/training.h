// "training" of a manifest: the cost of training an algorithm outside of the benchmark, so that reports can compare it
// with the savings. Either the numbers, or the name of a file parameter: the JSON file beside that file (model.json
// beside model.onnx) has them under "trained", as relign-train writes it, so that a user's own model has its own cost.
//
//   "training": {"hours": 1.4, "steps": 412800, "machine": "EPYC, 2 threads"}    each member is optional
//   "training": "model"
#pragma once

#include <optional>
#include <vector>

#include "plugin_host/catalog.h"
#include "plugin_host/manifest.h"

namespace relign::plugin_host {

// Sum of {hours, steps, machine} over the algorithm and those that it runs. hours and steps are null where one of them
// is unknown; the hours of a warm start ("trained": {"warm_start": {"hours"}}) count. Null for an untrained algorithm.
// Never throws: an unreadable side file counts as unknown.
Json training_of(const Choice& choice);

// The JSON file beside the model of this choice (not of algorithms that it runs); null for other plugins, and when it
// cannot be read. "reproducible": "this_cpu" in it overrides the manifest: the code for this model differs between
// processors.
Json side_file_of(const Choice& choice);

// The file parameter that "training" names: the trained model. Empty where the manifest names none.
std::string training_parameter(const Manifest& manifest);

// Checks the key "training" of a manifest whose parameters have been read; mistakes become problems.
void check_training(const JsonSource& source, ObjectReader& reader, const Manifest& manifest,
                    std::vector<Problem>& problems);

// "prepare" of a manifest: the pretraining that an algorithm asks for, on source instances (relign.prepared/1).

// The extent of an algorithm's pretraining: the number of source instances, and of steps on each.
struct Pretraining {
  unsigned sources = 0;
  unsigned steps = 0;
};

// The pretraining with these effective parameters; nothing for a plugin without "prepare".
std::optional<Pretraining> pretraining(const Manifest& manifest, const Json& parameters);

// Whether this algorithm, or one that it runs, has pretraining.
bool is_prepared(const Choice& choice);

// Reads the key "prepare" into the manifest, whose parameters must have been read; mistakes become problems.
void read_pretraining(const JsonSource& source, ObjectReader& reader, Manifest& manifest,
                      std::vector<Problem>& problems);

}  // namespace relign::plugin_host
