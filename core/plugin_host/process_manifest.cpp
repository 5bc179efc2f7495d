#include "plugin_host/process_manifest.h"

#include <algorithm>
#include <vector>

#include "base/files.h"
#include "base/hash.h"
#include "plugin_host/process_plugin.h"

namespace relign::plugin_host {
namespace fs = std::filesystem;

namespace {

const char* const kInterpreter = "python3";

// The JSON object that the script writes, on one line.
std::string ask_script(const fs::path& script) {
  const auto refuse = [&](const std::string& sentence) {
    throw Error(ErrorKind::plugin_refused, script.string() + " is no plugin: `" + kInterpreter + " " +
                                               script.filename().string() + " --manifest` failed: " + sentence);
  };
  ChildProcess::Options options;
  options.command = {kInterpreter, script.filename().string(), "--manifest"};
  options.folder = script.parent_path();
  options.environment = process_environment();
  ChildProcess child(std::move(options));
  std::string line;
  const double patience_seconds = ProcessPatience::from_environment().handshake_seconds;
  const ChildProcess::Got got = child.receive(line, in_seconds(patience_seconds));
  child.end(got == ChildProcess::Got::late ? 0 : 2);
  if (got == ChildProcess::Got::end)
    refuse("it wrote none; end the file with serve(YourClass) of relign_bench.plugin" + ending_text(child));
  if (got != ChildProcess::Got::line)
    refuse(got_text(got, "it said nothing for " + std::to_string(static_cast<int>(patience_seconds)) + " s") +
           ending_text(child));
  const Json manifest = Json::parse(line, nullptr, false);
  if (!manifest.is_object()) refuse("what it wrote is no JSON object" + ending_text(child));
  return canonical_json(manifest);
}

// What answers besides the script: relign_bench, whose defaults are part of the manifest.
std::string relign_bench_text() {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(python_folder() / "relign_bench" / "plugin", error), end; !error && entry != end;
       entry.increment(error))
    if (entry->path().extension() == ".py") files.push_back(entry->path());
  std::sort(files.begin(), files.end());
  std::string text;
  for (const fs::path& file : files) text += read_file(file);
  return text;
}

}  // namespace

bool is_plugin_script(const fs::path& path) { return path.extension() == ".py"; }

Manifest read_script_manifest(const fs::path& script) {
  std::string content;
  try {
    content = read_file(script) + relign_bench_text();
  } catch (const Error& error) {
    throw Error(ErrorKind::plugin_refused, error.what());
  }
  const fs::path cache = cache_folder();
  const fs::path kept =
      cache.empty() ? cache : cache / "manifests" / (short_hash("script manifest 2\n" + content) + ".json");
  std::error_code error;
  std::string text;
  if (!kept.empty() && fs::exists(kept, error)) {
    try {
      text = read_file(kept);
      if (!Json::parse(text, nullptr, false).is_object()) text.clear();
    } catch (const Error&) {  // asked again
    }
  }
  const bool known = !text.empty();
  if (!known) text = ask_script(script);
  Manifest manifest = read_manifest_text(text, script);
  manifest.command = {kInterpreter, script.filename().string()};
  manifest.library = script;
  if (!known && !kept.empty()) {
    try {
      write_file_atomically(kept, text);
    } catch (const Error&) {  // asked again next time
    }
  }
  return manifest;
}

}  // namespace relign::plugin_host
