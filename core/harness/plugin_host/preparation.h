// "prepare" of a manifest: what a plugin wants to learn beforehand, on source instances (relign.prepared/1).
#pragma once

#include <optional>
#include <vector>

#include "plugin_host/catalog.h"
#include "plugin_host/manifest.h"

namespace relign::plugin_host {

// How an algorithm is prepared: conversations on so many source instances, of so many steps each.
struct Preparation {
  unsigned sources = 0;
  unsigned steps = 0;
};

// What "prepare" means with these effective parameters; nothing for a plugin that is never prepared.
std::optional<Preparation> preparation(const Manifest& manifest, const Json& parameters);

// Whether this algorithm, or one that it runs, is ever prepared.
bool is_prepared(const Choice& choice);

// Reads the key "prepare" into the manifest, whose parameters are read already; mistakes become problems.
void read_preparation(const JsonSource& source, ObjectReader& reader, Manifest& manifest,
                      std::vector<Problem>& problems);

}  // namespace relign::plugin_host
