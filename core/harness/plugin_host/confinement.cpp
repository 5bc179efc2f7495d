#include "plugin_host/confinement.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <mutex>
#include <set>
#include <string_view>

#include "base/error.h"
#include "base/files.h"
#include "base/machine.h"
#include "plugin_host/process_manifest.h"
#include "plugin_host/process_plugin.h"

namespace relign::plugin_host {
namespace fs = std::filesystem;

namespace {

// Variables without paths that may change how a plugin computes.
constexpr const char* kKeptVariables[] = {
    "LANG", "LC_ALL", "TZ", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "RELIGN_ISA"};
constexpr double kSecondsOfInterpreter = 30;

bool contains(const fs::path& folder, const fs::path& file) {
  const fs::path inside = file.lexically_relative(folder);
  return !inside.empty() && *inside.begin() != "..";
}

fs::path resolved(const fs::path& path) {
  std::error_code error;
  const fs::path found = fs::canonical(path, error);
  return error ? path : found;
}

// The prefix of the installation or build: program and plugins are ../ of the program's folder.
fs::path own_prefix() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path() : program.parent_path().parent_path();
}

fs::path own_program(const char* name) { return own_prefix() / "lib" / "relign-bench" / "bin" / name; }

void check_shown(const fs::path& path) {
  const char* home = std::getenv("HOME");
  const fs::path real = resolved(path);
  const bool root = real == real.root_path();
  if (!root && !(home && *home && contains(real, resolved(home)))) return;
  throw Error(ErrorKind::bad_input, "a sandbox cannot show '" + path.string() + "', which is " +
                                        (root ? "the whole system" : "or contains your home folder") +
                                        "; move the plugin into a folder of its own");
}

// An interpreter, as it describes itself: a launcher such as pyenv's does not work without its files.
struct Interpreter {
  std::string program;
  std::set<fs::path> prefixes;  // its own, and that of the Python that a virtual environment was made from
};

const Interpreter& interpreter(const std::string& program) {
  static std::mutex mutex;
  static std::map<std::string, Interpreter> known;
  const std::lock_guard<std::mutex> lock(mutex);
  if (const auto found = known.find(program); found != known.end()) return found->second;
  std::vector<std::string> lines;
  ChildProcess::Options options;
  options.command = {program, "-I", "-c", "import sys; print(sys.executable, sys.prefix, sys.base_prefix, sep='\\n')"};
  options.folder = "/";
  options.on_output = [&lines](const std::string& line) { lines.push_back(line); };
  ChildProcess child(std::move(options));
  child.end(kSecondsOfInterpreter);
  if (lines.size() != 3 || lines[0].empty())
    throw Error(ErrorKind::plugin_rejected, "'" + program + "' does not work: it " + child.how_it_ended());
  return known[program] = {lines[0], {lines[1], lines[2]}};
}

bool is_python(const std::string& command) { return fs::path(command).filename().string().rfind("python", 0) == 0; }

// Copies of relign_bench, whose compiled module renders and whose wheel has the program.
void add_python_packages(const fs::path& prefix, std::vector<fs::path>& packages) {
  std::error_code error;
  for (fs::directory_iterator entry(prefix / "lib", error), end; !error && entry != end; entry.increment(error))
    if (entry->path().filename().string().rfind("python", 0) == 0)
      for (const char* folder : {"site-packages", "dist-packages"})
        packages.push_back(entry->path() / folder / "relign_bench");
}

class Order {
 public:
  void show(const fs::path& path) {
    check_shown(path);
    std::error_code error;
    if (fs::exists(path, error)) add("show", fs::absolute(path).lexically_normal());
  }
  void hide(const fs::path& path) { add("hide", fs::absolute(path).lexically_normal()); }
  void add(const char* key, const std::string& value) {
    words.emplace_back(key);
    words.push_back(value);
  }
  std::vector<std::string> words;
};

std::vector<std::string> confined_environment(const std::vector<std::string>& additions) {
  std::vector<std::string> all = {"PATH=/usr/local/bin:/usr/bin:/bin", "HOME=/tmp",       "TMPDIR=/tmp", "USER=plugin",
                                  "PYTHONDONTWRITEBYTECODE=1",         "PYTHONHASHSEED=0"};
  for (const char* name : kKeptVariables)
    if (const char* value = std::getenv(name)) all.push_back(std::string(name) + "=" + value);
  if (const fs::path folder = python_folder(); !folder.empty()) all.push_back("PYTHONPATH=" + folder.string());
  for (const std::string& one : additions)
    if (one.rfind("PYTHON", 0) != 0) all.push_back(one);
  return all;
}

std::string find_problem() {
  std::error_code error;
  const fs::path launcher = own_program("relign-sandbox");
  if (!fs::exists(launcher, error)) return "'" + launcher.string() + "' is missing: install relign-bench again";
  std::vector<std::string> lines;
  ChildProcess::Options options;
  options.command = {launcher, "--"};
  options.on_output = [&lines](const std::string& line) { lines.push_back(line); };
  ChildProcess child(std::move(options));
  child.end(kSecondsOfInterpreter);
  if (child.crash() == "crashed(exit 0)") return "";
  const std::string prefix = "sandbox: ";
  if (lines.empty()) return "the launcher " + child.how_it_ended();
  return lines.back().rfind(prefix, 0) == 0 ? lines.back().substr(prefix.size()) : lines.back();
}

}  // namespace

Json to_json(const Sandbox& sandbox) {
  const auto texts = [](const std::vector<fs::path>& paths) {
    Json list = Json::array();
    for (const fs::path& path : paths) list.push_back(path.string());
    return list;
  };
  return {{"shown", texts(sandbox.shown)}, {"hidden", texts(sandbox.hidden)}, {"memory_bytes", sandbox.memory_bytes}};
}

Sandbox sandbox_from_json(const Json& json) {
  Sandbox sandbox;
  for (const Json& path : json.at("shown")) sandbox.shown.emplace_back(path.get<std::string>());
  for (const Json& path : json.at("hidden")) sandbox.hidden.emplace_back(path.get<std::string>());
  sandbox.memory_bytes = json.at("memory_bytes").get<std::size_t>();
  return sandbox;
}

const std::string& sandbox_problem() {
  static const std::string problem = find_problem();
  return problem;
}

void confine(ChildProcess::Options& options, const std::vector<fs::path>& granted, const Sandbox& sandbox) {
  Order order;
  std::vector<std::string> command = options.command;
  std::vector<fs::path> packages;
  add_python_packages("/usr", packages);
  add_python_packages("/usr/local", packages);
  if (is_python(command.front())) {
    const Interpreter& found = interpreter(command.front());
    command.front() = found.program;
    for (const fs::path& prefix : found.prefixes) {
      if (prefix != "/usr") order.show(prefix);
      add_python_packages(prefix, packages);
    }
  }
  for (const fs::path& path : sandbox.shown) order.show(path);
  // The program and what it knows about lenses; then the parts of it that a plugin needs.
  std::error_code error;
  if (const fs::path own = fs::read_symlink("/proc/self/exe", error); !error) order.hide(own);
  for (const char* folder : {"lib", "share"}) order.hide(own_prefix() / folder / "relign-bench");
  for (const fs::path& root : Catalog::default_roots()) order.hide(root);
  for (const fs::path& package : packages) order.hide(package);
  if (const fs::path folder = python_folder(); !folder.empty()) {
    order.show(folder / "relign_bench" / "plugin");
    order.show(folder / "relign_bench" / "__init__.py");
  }
  for (const fs::path& path : granted) order.show(path);
  for (const fs::path& path : sandbox.hidden) order.hide(path);
  order.add("folder", options.folder.empty() ? "/" : fs::absolute(options.folder).lexically_normal().string());
  order.add("memory", std::to_string(sandbox.memory_bytes));
  order.add("processes", std::to_string(Sandbox::kProcesses));
  order.add("disk", std::to_string(Sandbox::kDiskBytes));
  options.command = {own_program("relign-sandbox").string()};
  options.command.insert(options.command.end(), order.words.begin(), order.words.end());
  options.command.emplace_back("--");
  options.command.insert(options.command.end(), command.begin(), command.end());
  options.environment = confined_environment(options.environment);
  options.inherits_environment = false;
  options.is_confined = true;
}

std::vector<fs::path> files_of_script(const fs::path& script) {
  constexpr std::size_t kMost = 256;
  std::vector<fs::path> files = {script};
  std::error_code error;
  const fs::path real = resolved(script);
  if (real != script) files.push_back(real);
  for (fs::directory_iterator entry(real.parent_path(), error), end; !error && entry != end; entry.increment(error)) {
    std::error_code ignored;
    const fs::path& path = entry->path();
    if (entry->is_symlink(ignored)) continue;  // a stranger's link may lead to the user's files
    const bool module = path.extension() == ".py" && entry->is_regular_file(ignored);
    if (path != real && (module || fs::exists(path / "__init__.py", ignored))) files.push_back(path);
  }
  if (files.size() > kMost)
    throw Error(ErrorKind::bad_input, "'" + script.string() + "' lies among more than " + std::to_string(kMost) +
                                          " Python files, all of which a sandbox would show; move it into a folder of "
                                          "its own");
  return files;
}

std::vector<fs::path> files_of(const Choice& choice) {
  const Manifest& manifest = *choice.plugin;
  std::vector<fs::path> files =
      is_plugin_script(manifest.source) ? files_of_script(manifest.source) : std::vector<fs::path>{manifest.folder};
  for (const Parameter& parameter : manifest.parameters) {
    const auto found = choice.parameters.find(parameter.name);
    if (parameter.type != ParameterType::file || found == choice.parameters.end() || !found->is_string()) continue;
    const fs::path file = found->get<std::string>();
    if (file.empty()) continue;
    files.push_back(file);
    std::error_code error;
    for (fs::directory_iterator entry(file.parent_path(), error), end; !error && entry != end; entry.increment(error))
      if (!entry->is_symlink(error) && entry->path().filename().string().rfind(file.stem().string() + ".", 0) == 0)
        files.push_back(entry->path());
  }
  return files;
}

std::vector<std::string> library_command(const Manifest& manifest) {
  return {own_program("relign-library-host").string(), manifest.source.string()};
}

std::string_view log_prefix(int level) {
  return level >= RELIGN_LOG_WARNING ? "warning: " : level < RELIGN_LOG_INFO ? "debug: " : "";
}

}  // namespace relign::plugin_host
