// A choice as JSON, for a process that finds no plugins itself: all that it needs is in it, the manifest's text
// included.
#pragma once

#include "plugin_host/catalog.h"

namespace relign::plugin_host {

Json to_json(const Choice& choice);

// Throws Error(plugin_refused) when the manifest cannot be read, Error(internal) when `json` is nothing that to_json
// made.
Choice choice_from_json(const Json& json);

}  // namespace relign::plugin_host
