// Projects for new plugins, copied from templates: real projects of a plugin called my_plugin, whose class is
// MyPlugin; one folder KIND-LANGUAGE each, installed below share/relign-bench/templates.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace relign::cli {

struct NewPlugin {
  std::string kind;  // "noise-level", as manifests write it
  std::string language;
  std::string name;              // id, file names, target
  std::filesystem::path folder;  // is made; must not exist
};

// Where this program's templates lie. Throws Error(io) when they are missing.
std::filesystem::path template_folder();

// "agent in cpp, agent in python, ...", sorted.
std::vector<std::string> known_templates(const std::filesystem::path& templates);

// What is wrong with a name for a new plugin, empty when nothing is: ids that are also names of C++ and Python files.
std::string check_plugin_name(const std::string& name);

// "my_search" -> "MySearch".
std::string class_name(const std::string& name);

// Writes the whole project, or nothing. Throws Error(bad_input or io).
void write_project(const std::filesystem::path& templates, const NewPlugin& wanted);

}  // namespace relign::cli
