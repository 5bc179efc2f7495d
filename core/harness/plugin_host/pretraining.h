// "prepare" of a manifest: the pretraining that an algorithm asks for, on source instances (relign.prepared/1).
#pragma once

#include <optional>
#include <vector>

#include "plugin_host/catalog.h"
#include "plugin_host/manifest.h"

namespace relign::plugin_host {

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
