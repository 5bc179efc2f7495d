// Files that are installed with the program, in ../share/relign-bench beside it.
#pragma once

#include <filesystem>
#include <string>

namespace relign::cli {

// share/relign-bench/NAME; the folder may be missing.
std::filesystem::path shared_folder(const std::string& name);

// The argument as a path; a plain name without an ending that is not a file here is one of the installed suites:
// "quick".
std::filesystem::path suite_file(const std::string& argument);

}  // namespace relign::cli
