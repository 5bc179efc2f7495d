// The symbols that a shared library offers to others, read from the file: nothing is loaded.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace relign::conformance {

// Names that the library defines and exports, sorted. Throws Error(plugin_refused) when the file is no
// complete shared library of this machine's kind.
std::vector<std::string> exported_symbols(const std::filesystem::path& library);

}  // namespace relign::conformance
