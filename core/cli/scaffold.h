// Creates plugin projects from templates. A template is a complete project of a plugin my_plugin with class MyPlugin,
// in a folder KIND-LANGUAGE below share/relign-bench/templates, or scene-readings-LANGUAGE or scene-both-LANGUAGE.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace relign::cli {

struct NewPlugin {
  std::string kind;  // "noise-level", as manifests write it
  std::string language;
  std::string name;                 // id, file names, target
  std::filesystem::path folder;     // is created; must not exist
  std::string observes = "images";  // or "readings" or "both", of a scene
};

// The folder of the installed templates. Throws Error(io) if it is missing.
std::filesystem::path template_folder();

// "agent in cpp, agent in python, ...", sorted.
std::vector<std::string> known_templates(const std::filesystem::path& templates);

// The mistake in a plugin name, or empty. Names must be valid as ids and as names of C++ and Python files.
std::string check_plugin_name(const std::string& name);

// "my_search" -> "MySearch".
std::string class_name(const std::string& name);

// Writes the complete project, or nothing. Throws Error: bad_input, io.
void write_project(const std::filesystem::path& templates, const NewPlugin& wanted);

}  // namespace relign::cli
