// relign-bench doctor: checks the installation and this machine.
#include <sys/utsname.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "base/files.h"
#include "base/machine.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/text_table.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.rfind("model name", 0) == 0 && line.find(": ") != std::string::npos)
      return line.substr(line.find(": ") + 2);
  utsname machine{};
  return ::uname(&machine) == 0 ? machine.machine : "unknown";
}

Finding memory() {
  constexpr std::size_t kScene = 1'000'000'000;  // a scene needs less, unless its sensor has tens of millions of pixels
  const std::size_t usable = usable_memory_bytes();
  const auto limit = memory_limit(usable);
  if ((limit ? limit->bytes : usable) >= core_count() * kScene) return {"memory", "ok", memory_words()};
  return {"memory", "note",
          memory_words() +
              ": less than 1 GB for each core; a scene may need that much in each worker ('validate' "
              "measures it), so limit the workers of a run with --workers"};
}

Finding folder(const char* what, const fs::path& path, const char* otherwise) {
  if (!path.empty() && ::access(path.c_str(), W_OK | X_OK) == 0) return {what, "ok", path.string()};
  return {what, "wrong",
          (path.empty() ? std::string("none") : "'" + path.string() + "' is not writable") + ": " + otherwise};
}

Finding program(const char* name, const char* otherwise) {
  const fs::path found = program_on_path(name);
  return found.empty() ? Finding{name, "note", otherwise} : Finding{name, "ok", found.string()};
}

// The interpreter of Python plugins.
Finding python() {
  const char* chosen = std::getenv("RELIGN_PYTHON");
  if (chosen == nullptr || *chosen == '\0') return program("python3", "not on PATH: Python plugins cannot run");
  const fs::path found = program_on_path(chosen);
  if (found.empty())
    return {"python3", "wrong",
            "RELIGN_PYTHON is '" + std::string(chosen) + "', which is no program: Python plugins cannot run"};
  return {"python3", "ok", found.string() + " (RELIGN_PYTHON)"};
}

Finding sandbox() {
  const std::string& problem = plugin_host::sandbox_problem();
  return problem.empty() ? Finding{"sandbox", "ok", "--sandbox is possible"}
                         : Finding{"sandbox", "note", "--sandbox is not possible: " + problem};
}

void check_plugins(Context& context, std::vector<Finding>& findings) {
  plugin_host::Catalog catalog;
  for (const fs::path& root : plugin_host::Catalog::default_roots()) {
    const std::size_t before = catalog.plugins().size();
    catalog.scan(root);
    std::error_code code;
    if (!fs::is_directory(root, code))
      findings.push_back({"plugin folder", "wrong",
                          "'" + root.string() + "' does not exist; set RELIGN_PLUGIN_PATH to an existing folder"});
    else
      findings.push_back({"plugin folder", "ok",
                          root.string() + ": " + std::to_string(catalog.plugins().size() - before) + " plugins"});
  }
  for (const std::string& plugin : context.plugin_paths) {
    try {
      catalog.add(plugin);
      findings.push_back({"plugin", "ok", plugin});
    } catch (const Error& error) {
      findings.push_back({"plugin", "wrong", error.what()});
    }
  }
  for (const std::string& refused : catalog.refused()) findings.push_back({"plugin", "wrong", refused});
}

int check_machine(Context& context) {
  std::vector<Finding> findings;
  findings.push_back({"program", "ok",
                      "relign-bench " RELIGN_VERSION ", plugin interface " + std::to_string(RELIGN_ABI_MAJOR) + "." +
                          std::to_string(RELIGN_ABI_MINOR)});
  findings.push_back({"processor", "ok", processor_name()});
  findings.push_back({"cores", "ok", std::to_string(core_count())});
  findings.push_back(memory());
  for (const auto& finding : context.extensions.findings) findings.push_back(finding());
  findings.push_back(folder("cache folder", cache_folder(),
                            "reference images and pretraining are repeated in every run; set XDG_CACHE_HOME to a "
                            "writable folder"));
  findings.push_back(folder("working folder", fs::current_path(),
                            "results are written to results/ here; choose another folder with --out"));
  findings.push_back(folder("temporary folder", fs::temp_directory_path(), "set TMPDIR to a writable folder"));
  check_plugins(context, findings);
  findings.push_back(python());
  findings.push_back(sandbox());
  findings.push_back(program("sbatch", "not on PATH: Slurm jobs cannot be submitted from here"));

  bool all_well = true;
  Json list = Json::array();
  TextTable table({"what", "", "found"});
  for (const Finding& finding : findings) {
    all_well = all_well && finding.state != "wrong";
    list.push_back({{"what", finding.what}, {"state", finding.state}, {"found", finding.found}});
    table.add({finding.what, finding.state, finding.found});
  }
  print_result(context.json ? list.dump(2, ' ', false, Json::error_handler_t::replace) + "\n" : table.text());
  return all_well ? kDone : kBadInput;
}

}  // namespace

void add_doctor(CLI::App& app, Context& context) {
  CLI::App& verb =
      add_verb(app, {"doctor", "Check the installation and this machine. Exit code 2 if something is wrong.",
                     "relign-bench doctor", "list, run"});
  verb.callback([&context] { context.action = [&context] { return check_machine(context); }; });
}

}  // namespace relign::cli
