#include "cli/shared_files.h"

namespace relign::cli {

namespace fs = std::filesystem;

fs::path shared_folder(const std::string& name) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return program.parent_path().parent_path() / "share" / "relign-bench" / name;
}

fs::path suite_file(const std::string& argument) {
  std::error_code error;
  const fs::path given = argument;
  if (fs::exists(given, error) || given.has_parent_path() || given.has_extension()) return given;
  const fs::path installed = shared_folder("suites") / (argument + ".json");
  return fs::exists(installed, error) ? installed : given;
}

}  // namespace relign::cli
