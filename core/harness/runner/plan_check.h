// Whether a results folder's manifest is what its suite plans, without a replay: from the manifests of the plugins
// alone, of which none is loaded or started, since the folder may come from anyone. `verify` compares the same with the
// scenes themselves.
#pragma once

#include <filesystem>

#include "plugin_host/catalog.h"
#include "records/folder_checks.h"

namespace relign::runner {

// `suite_folder`: to which relative paths of the suites refer; empty: the folders of the suite files in the manifest.
// The check is not made where the manifest lacks a suite's text, or a plugin or a file of the suite is not here.
records::Check check_plan(const records::Manifest& manifest, plugin_host::Catalog catalog,
                          const std::filesystem::path& suite_folder = {});

}  // namespace relign::runner
