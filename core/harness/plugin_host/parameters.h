// Effective parameters of a plugin: the manifest's defaults, then the preset's, then the user's.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/error.h"
#include "plugin_host/manifest.h"

namespace relign::plugin_host {

struct EffectiveParameters {
  Json values = Json::object();    // file parameters are absolute paths; numbers are normalised (1 = 1.0)
  Json identity = Json::object();  // the same with the SHA-256 of the content for file parameters
};

// Appends every mistake to `problems`: unknown names with the nearest known one, wrong types, values
// out of range, missing values and files (pointer "/parameters/NAME", or "" for missing values).
// `given` is an object or null; its files are relative to `relative_to`, those of the manifest to
// its folder. `-` equals `_` in names. An optional file (default "") may be empty. That
// one and parameters added later are part of the identity only if they differ from their defaults.
EffectiveParameters effective_parameters(const Manifest& manifest, const Preset* preset, const Json& given,
                                         const std::filesystem::path& relative_to, std::vector<Problem>& problems);

// A name, escaped as a token of a JSON pointer.
std::string pointer_token(const std::string& name);

}  // namespace relign::plugin_host
