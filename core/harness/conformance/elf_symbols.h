// The exported symbols of a shared library, read from the file without loading it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace relign::conformance {

// Names that the library defines and exports, sorted. Throws Error(plugin_rejected) unless the file is a complete
// shared library for this machine.
std::vector<std::string> exported_symbols(const std::filesystem::path& library);

}  // namespace relign::conformance
