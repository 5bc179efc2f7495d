// Finds files that are installed with the program, in share/relign-bench next to its bin folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace relign::cli {

// share/relign-bench/NAME; the folder may be missing.
std::filesystem::path shared_folder(const std::string& name);

inline constexpr const char* kSuiteHelp =
    "suite file (JSON: scenes, noise levels, algorithms), or the name of an installed one, such as quick";

// Names of the installed suites, sorted.
std::vector<std::string> installed_suites();

// The path of a suite argument. A name without folder and extension that is not a file, such as "quick", is looked up
// among the installed suites. Throws Error(bad_input) for neither.
std::filesystem::path suite_file(const std::string& argument);

}  // namespace relign::cli
