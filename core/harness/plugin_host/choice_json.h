// A choice as JSON: complete, with the manifest's text, for a process that does not search plugins; or only its
// parameters, as results record them.
#pragma once

#include "plugin_host/catalog.h"

namespace relign::plugin_host {

Json to_json(const Choice& choice);

// Throws Error(plugin_rejected) when the manifest cannot be read, Error(internal) when `json` did not come from
// to_json.
Choice choice_from_json(const Json& json);

// The effective parameters as results record them, equal on every machine: a file is given by its name (relative to the
// plugin's folder if it is inside) and the SHA-256 of its content: "imitation-ppo.onnx (sha256:1f0c9a2b3d4e5f60)".
Json recorded_parameters(const Choice& choice);

}  // namespace relign::plugin_host
