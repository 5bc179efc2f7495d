// The environment of a Python plugin: exact versions of packages, in the form of pip's requirements files.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace relign::submissions {

// Package and version.
using Packages = std::map<std::string, std::string>;

// Lower case, with '-' for every run of '-', '_' and '.', as Python's package index compares names.
std::string normalised_package(std::string_view name);

// Reads lines "name==version", with comments, hashes ("--hash=...") and markers ("; python_version ..."), whose
// packages are left out because they may not apply. Throws Error(bad_input) that names `file` and the line for anything
// else: a range of versions is not a lock.
Packages read_lock(const std::string& text, const std::string& file);

// What `installed` lacks of `locked`: "numpy 1.26.4 (found 2.0.1), scipy 1.11.4 (not installed)"; empty if nothing.
std::string missing_packages(const Packages& locked, const Packages& installed);

}  // namespace relign::submissions
