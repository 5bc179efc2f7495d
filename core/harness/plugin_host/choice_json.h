// A choice as JSON: whole, for a process that finds no plugins itself, the manifest's text included; or its parameters
// alone, as results tell them.
#pragma once

#include "plugin_host/catalog.h"

namespace relign::plugin_host {

Json to_json(const Choice& choice);

// Throws Error(plugin_refused) when the manifest cannot be read, Error(internal) when `json` is nothing that to_json
// made.
Choice choice_from_json(const Json& json);

// The effective parameters as results record them, equal on every machine: a file is told by its name, below the
// plugin's folder where it lies there, and the SHA-256 of its content: "imitation-ppo.onnx (sha256:1f0c9a2b3d4e5f60)".
Json recorded_parameters(const Choice& choice);

}  // namespace relign::plugin_host
