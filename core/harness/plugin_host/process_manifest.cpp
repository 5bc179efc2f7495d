#include "plugin_host/process_manifest.h"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "base/files.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/text.h"
#include "plugin_host/confinement.h"
#include "plugin_host/process_plugin.h"

namespace relign::plugin_host {
namespace fs = std::filesystem;

namespace {

// RELIGN_PYTHON names the Python of a virtual environment, which may be the only one with the script's imports.
std::string interpreter() {
  const char* chosen = std::getenv("RELIGN_PYTHON");
  return chosen && *chosen ? chosen : "python3";
}

}  // namespace

std::string missing_module(const std::string& line) {
  const std::string error = "ModuleNotFoundError: ", pythons_own = "No module named '";
  if (!line.starts_with(error)) return "";
  const std::string text = line.substr(error.size());
  if (!text.starts_with(pythons_own)) return text;  // the author's, who knows the package
  const std::string module = text.substr(pythons_own.size(), text.find('\'', pythons_own.size()) - pythons_own.size());
  return text + "; install its package, `" + interpreter() + " -m pip install " + module.substr(0, module.find('.')) +
         "` if it has the module's name, or set RELIGN_PYTHON to a Python that has it";
}

namespace {

const char* const kFiles = "files";  // a list of modules from the script; in the cache an object with their hashes

// The first folder that Python searches for a script's modules: that of the file itself, not of a link to it.
fs::path module_folder(const fs::path& script) {
  std::error_code error;
  const fs::path file = fs::canonical(script, error);
  return (error ? script : file).parent_path();
}

// The modules of `names` (a list of paths below `folder`, from the script) with the SHA-256 of each.
Json hashes_of(const Json& names, const fs::path& folder) {
  Json hashes = Json::object();
  for (const Json& name : names) {
    const fs::path file = name.is_string() ? fs::path(name.get<std::string>()) : fs::path();
    if (file.empty() || file.is_absolute()) continue;
    try {
      hashes[file.generic_string()] = sha256_file(folder / file);
    } catch (const Error&) {  // deleted meanwhile; it will be missing the next time, too
    }
  }
  return hashes;
}

// Runs the script for its manifest: a JSON object on one line.
std::string run_for_manifest(const fs::path& script, const Sandbox* sandbox) {
  const auto refuse = [&](const std::string& message) {
    throw Error(ErrorKind::plugin_rejected, script.string() + " is not a plugin: `" + interpreter() + " " +
                                                script.filename().string() + " --manifest` failed: " + message);
  };
  ChildProcess::Options options;
  options.command = {interpreter(), script.filename().string(), "--manifest"};
  options.folder = script.parent_path();
  options.environment = process_environment();
  if (sandbox) confine(options, files_of_script(script), *sandbox);
  ChildProcess child(std::move(options));
  std::string line;
  const double timeout_seconds = ProcessTimeouts::from_environment().handshake_seconds;
  const ChildProcess::Got got = child.receive(line, in_seconds(timeout_seconds));
  child.end(got == ChildProcess::Got::late ? 0 : 2);
  if (got == ChildProcess::Got::end) {
    // For a missing import or a syntax error the last line of a traceback is the message.
    const bool raised = child.crash() != "crashed(exit 0)" && !child.last_output().empty();
    if (const std::string missing = raised ? missing_module(child.last_output().back()) : ""; !missing.empty())
      throw Error(ErrorKind::plugin_rejected, script.string() + " cannot be started: " + missing);
    if (raised && child.last_output().size() == 1)  // no traceback, but a message
      throw Error(ErrorKind::plugin_rejected, script.string() + " cannot be used: " + child.last_output().back());
    refuse((raised ? child.last_output().back()
                   : "it printed no manifest; end the file with serve(YourClass) of relign_bench.plugin") +
           ending_text(child));
  }
  if (got != ChildProcess::Got::line)
    refuse(got_text(got, "it printed nothing for " + std::to_string(static_cast<int>(timeout_seconds)) + " s") +
           ending_text(child));
  Json manifest = parsed_json(line);
  if (!manifest.is_object()) refuse("expected a JSON object" + ending_text(child));
  if (manifest.contains(kFiles)) manifest[kFiles] = hashes_of(manifest[kFiles], module_folder(script));
  return canonical_json(manifest);
}

// The source of relign_bench, whose defaults are part of a script's manifest.
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

// The cached manifest; empty when there is none, or when a module has changed.
std::string cached_text(const fs::path& kept, const fs::path& folder) {
  std::error_code error;
  if (kept.empty() || !fs::exists(kept, error)) return "";
  try {
    const std::string text = read_file(kept);
    const Json manifest = parsed_json(text);
    if (!manifest.is_object()) return "";
    Json names = Json::array();
    const Json files = manifest.value(kFiles, Json::object());
    for (const auto& [name, hash] : files.items()) names.push_back(name);
    return hashes_of(names, folder) == files ? text : "";
  } catch (const Error&) {
    return "";
  }
}

// Sorted, because the order of "observes" has no meaning.
Json knowledge(const Json& manifest) {
  Json words = manifest.value("observes", Json::array());
  if (words.is_array()) std::sort(words.begin(), words.end());
  return words;
}

std::string kind_of(const Json& manifest) {
  const Json kind = member(manifest, "kind");
  return kind.is_string() ? normalised_name(kind.get<std::string>()) : kind.dump();
}

}  // namespace

std::string manifest_difference(const Manifest& stated, const Json& sent) {
  const Json manifest = parsed_json(stated.text);
  const std::string advice = is_plugin_script(stated.source)
                                 ? "; a class must have the same manifest at every start"
                                 : "; make them equal, or remove the manifest and use the Python file as the plugin";
  const auto differ = [&advice](const std::string& what, const Json& ours, const Json& theirs) {
    const auto shown = [](const Json& value) { return value.is_null() ? "missing" : value.dump(); };
    return "it does not match its manifest: " + what + " is " + shown(ours) + " in the manifest and " + shown(theirs) +
           " in the class" + advice;
  };
  if (kind_of(manifest) != kind_of(sent)) return differ("'kind'", member(manifest, "kind"), member(sent, "kind"));
  if (knowledge(manifest) != knowledge(sent)) return differ("'observes'", knowledge(manifest), knowledge(sent));
  const Json ours = manifest.value("parameters", Json::object());
  const Json theirs = sent.value("parameters", Json::object());
  if (!theirs.is_object()) return "expected an object 'parameters' in its manifest, found " + theirs.dump();
  Json all = ours;
  all.update(theirs);
  for (const auto& [name, ignored] : all.items()) {
    const Json one = ours.value(name, Json()), other = theirs.value(name, Json());
    if (one.is_object() != other.is_object()) return differ("parameter '" + name + "'", one, other);
    if (!one.is_object()) continue;
    for (const char* part : {"type", "default", "minimum", "maximum", "allowed"})
      if (member(one, part) != member(other, part))
        return differ("'" + std::string(part) + "' of parameter '" + name + "'", member(one, part),
                      member(other, part));
  }
  return "";
}

bool is_plugin_script(const fs::path& path) { return path.extension() == ".py"; }

Manifest script_manifest_of(const std::string& text, const fs::path& script) {
  Json stated = valid_json(text);
  stated.erase(kFiles);
  Manifest manifest = read_manifest_text(canonical_json(stated), script);
  manifest.text = text;
  manifest.command = {interpreter(), script.filename().string()};
  manifest.library = script;
  return manifest;
}

Manifest read_script_manifest(const fs::path& script, const Sandbox* sandbox) {
  std::string content;
  try {
    content = read_file(script) + relign_bench_text();
  } catch (const Error& error) {
    throw Error(ErrorKind::plugin_rejected, error.what());
  }
  const fs::path cache = cache_folder();
  const fs::path kept =
      cache.empty()
          ? cache
          : cache / "manifests" / (short_hash("script manifest 4\n" + interpreter() + "\n" + content) + ".json");
  std::string text = cached_text(kept, module_folder(script));
  const bool known = !text.empty();
  if (!known) text = run_for_manifest(script, sandbox);
  Manifest manifest = script_manifest_of(text, script);
  if (!known && !kept.empty()) {
    try {
      write_file_atomically(kept, text);
    } catch (const Error&) {  // without a cache the script runs again next time
    }
  }
  return manifest;
}

}  // namespace relign::plugin_host
