// The suite with which a submission is evaluated: the organiser's, with the submitted algorithm added.
#pragma once

#include <filesystem>
#include <functional>

#include "base/json_source.h"
#include "plugin_host/catalog.h"
#include "submissions/submission.h"

namespace relign::submissions {

// The new place of a relative path.
using Relocate = std::function<std::string(const std::string& path)>;

// An entry of a suite's scenes, noise_levels or algorithms with every relative path replaced: of a plugin or document,
// of files that parameters name, and of algorithms in parameters. Ids stay. Mistakes stay, for the reader of suites.
Json relocated(const Json& entry, plugin_host::Kind kind, const std::filesystem::path& relative_to,
               plugin_host::Catalog& catalog, const Relocate& relocate);

// The suite's entry of the submission, whose files are in `folder`; `place` is that folder in the suite. Adds its
// plugin to the catalog. Throws Error: bad_input if the plugin is not the algorithm that the manifest names;
// plugin_rejected.
Json submitted_entry(const Submission& submission, const std::filesystem::path& folder, const std::string& place,
                     plugin_host::Catalog& catalog);

// The suite's text for a file in another folder: its own relative paths become absolute, and `entry` is its last
// algorithm. Throws Error(bad_input) if the suite has an algorithm of this name.
std::string evaluation_suite(const JsonSource& suite, const Json& entry, plugin_host::Catalog& catalog);

// Throws Error(bad_input) if the algorithm, or one that it runs, names a file that is neither in `folder` nor part of
// an installed plugin: a sandbox would show it.
void refuse_files_outside(const plugin_host::Choice& choice, const std::filesystem::path& folder);

}  // namespace relign::submissions
