// relign-bench doctor: what of this machine matters to runs, and what is wrong with it.
#include <sys/utsname.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/files.h"
#include "base/machine.h"
#include "base/text.h"
#include "cli/app.h"
#include "cli/text_table.h"
#include "optics/ray_block.h"

namespace relign::cli {
namespace {

namespace fs = std::filesystem;

// "note": works, but somebody may want to know. "wrong": something will not work.
struct Sign {
  std::string what, state, found;
};

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.rfind("model name", 0) == 0 && line.find(": ") != std::string::npos)
      return line.substr(line.find(": ") + 2);
  utsname machine{};
  return ::uname(&machine) == 0 ? machine.machine : "unknown";
}

// The first of this name on PATH; empty when there is none.
fs::path on_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (const fs::path file = fs::path(folder) / program; !folder.empty() && ::access(file.c_str(), X_OK) == 0)
      return file;
  return {};
}

Sign vector_instructions() {
  for (const char* set : {"avx512", "avx2"})
    if (optics::block_kernels(set)) return {"instructions", "ok", set};
  return {"instructions", "note",
          "no AVX2: the simulator is several times slower than the documents say, with equal images"};
}

Sign memory() { return {"memory", "ok", significant(static_cast<double>(usable_memory_bytes()) / 1e9) + " GB"}; }

Sign folder(const char* what, const fs::path& path, const char* otherwise) {
  if (!path.empty() && ::access(path.c_str(), W_OK | X_OK) == 0) return {what, "ok", path.string()};
  return {what, "wrong",
          (path.empty() ? std::string("none") : path.string() + " cannot be written") + ": " + otherwise};
}

Sign program(const char* name, const char* otherwise) {
  const fs::path found = on_path(name);
  return found.empty() ? Sign{name, "note", otherwise} : Sign{name, "ok", found.string()};
}

void look_at_plugins(Context& context, std::vector<Sign>& signs) {
  plugin_host::Catalog catalog;
  for (const fs::path& root : plugin_host::Catalog::default_roots()) {
    const std::size_t before = catalog.plugins().size();
    catalog.scan(root);
    std::error_code code;
    if (!fs::is_directory(root, code))
      signs.push_back({"plugin folder", "wrong", root.string() + " does not exist; RELIGN_PLUGIN_PATH may name it"});
    else
      signs.push_back({"plugin folder", "ok",
                       root.string() + ": " + std::to_string(catalog.plugins().size() - before) + " plugins"});
  }
  for (const std::string& plugin : context.plugin_paths) {
    try {
      catalog.add(plugin);
      signs.push_back({"plugin", "ok", plugin});
    } catch (const Error& error) {
      signs.push_back({"plugin", "wrong", error.what()});
    }
  }
  for (const std::string& refused : catalog.refused()) signs.push_back({"plugin", "wrong", refused});
}

int look(Context& context) {
  std::vector<Sign> signs;
  signs.push_back({"program", "ok",
                   "relign-bench " RELIGN_VERSION ", plugin interface " + std::to_string(RELIGN_ABI_MAJOR) + "." +
                       std::to_string(RELIGN_ABI_MINOR)});
  signs.push_back({"processor", "ok", processor_name()});
  signs.push_back(vector_instructions());
  signs.push_back({"cores", "ok", std::to_string(core_count())});
  signs.push_back(memory());
  signs.push_back(folder("cache folder", cache_folder(),
                         "reference images and what is prepared are made again in every run; XDG_CACHE_HOME may name "
                         "a folder that can be written"));
  signs.push_back(
      folder("working folder", fs::current_path(), "results go to results/ here; --out names another place"));
  signs.push_back(folder("temporary folder", fs::temp_directory_path(), "TMPDIR may name another one"));
  look_at_plugins(context, signs);
  signs.push_back(program("python3", "not on PATH: plugins in Python cannot run"));
  signs.push_back(program("sbatch", "not on PATH: no jobs can be sent to Slurm from here"));

  bool well = true;
  Json list = Json::array();
  TextTable table({"what", "", "found"});
  for (const Sign& sign : signs) {
    well = well && sign.state != "wrong";
    list.push_back({{"what", sign.what}, {"state", sign.state}, {"found", sign.found}});
    table.add({sign.what, sign.state, sign.found});
  }
  print_result(context.json ? list.dump(2, ' ', false, Json::error_handler_t::replace) + "\n" : table.text());
  return well ? kDone : kBadInput;
}

}  // namespace

void add_doctor(CLI::App& app, Context& context) {
  CLI::App& verb = add_verb(app, {"doctor",
                                  "Say what of this machine matters, and what is wrong; exit code 2 if "
                                  "something is.",
                                  "relign-bench doctor", "list, run"});
  verb.callback([&context] { context.action = [&context] { return look(context); }; });
}

}  // namespace relign::cli
