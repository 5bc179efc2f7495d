#include "cli/shared_files.h"

#include <algorithm>

#include "base/error.h"
#include "base/text.h"

namespace relign::cli {

namespace fs = std::filesystem;

fs::path shared_folder(const std::string& name) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return program.parent_path().parent_path() / "share" / "relign-bench" / name;
}

std::vector<std::string> installed_suites() {
  std::error_code error;
  std::vector<std::string> installed;
  for (fs::directory_iterator entry(shared_folder("suites"), error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().extension() == ".json") installed.push_back(entry->path().stem().string());
  std::sort(installed.begin(), installed.end());
  return installed;
}

fs::path suite_file(const std::string& argument) {
  std::error_code error;
  // A results folder may have the name of an installed suite.
  if (fs::exists(argument, error) && !fs::is_directory(argument, error)) return argument;
  const std::vector<std::string> installed = installed_suites();
  if (std::find(installed.begin(), installed.end(), argument) != installed.end())
    return shared_folder("suites") / (argument + ".json");
  const std::string nearest = nearest_name(fs::path(argument).stem().string(), installed);
  throw Error(ErrorKind::bad_input, "SUITE: no file '" + argument + "'; " +
                                        (nearest.empty() ? "installed suites: " + join(installed, ", ")
                                                         : "did you mean the installed suite '" + nearest + "'?"));
}

}  // namespace relign::cli
