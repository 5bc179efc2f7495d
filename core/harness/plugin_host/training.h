// "training" of a manifest: what an algorithm's learning outside the benchmark has cost, so that reports can set it
// against what it saves. Either the numbers, or the name of a file parameter: the JSON beside that file (model.onnx,
// model.json) has them under "trained", as relign-train writes it, and a user's own model tells its own.
//
//   "training": {"hours": 1.4, "steps": 412800, "machine": "EPYC, 2 threads"}    each of them may be left out
//   "training": "model"
#pragma once

#include "plugin_host/catalog.h"
#include "plugin_host/manifest.h"

namespace relign::plugin_host {

// {hours, steps, machine} of the algorithm and those that it runs, added up; hours and steps are null where one of them
// does not tell, a warm start's hours ("trained": {"warm_start": {"hours"}}) count. Null for an algorithm that learnt
// nothing. Never throws: a side file that cannot be read is one that tells nothing.
Json training_of(const Choice& choice);

// That JSON, of the choice's own plugin; null for other plugins, and where it cannot be read. Its key "reproducible":
// "this_cpu" takes back what a manifest promises: the plugin runs this model by code that differs between processors.
Json side_file_of(const Choice& choice);

// The file parameter that "training" names: which trained model runs. Empty where the manifest names none.
std::string training_parameter(const Manifest& manifest);

// Checks the key "training" of a manifest whose parameters are read already; mistakes become problems.
void check_training(const JsonSource& source, ObjectReader& reader, const Manifest& manifest,
                    std::vector<Problem>& problems);

}  // namespace relign::plugin_host
