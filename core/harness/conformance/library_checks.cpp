// Checks of every plugin: its library, its manifest, and its side effects on the process.
#include <dlfcn.h>

#include <algorithm>
#include <thread>
#include <type_traits>

#include "base/error.h"
#include "base/text.h"
#include "conformance/checks.h"
#include "conformance/conduct.h"
#include "conformance/elf_symbols.h"
#include "conformance/progress.h"
#include "plugin_host/guard.h"
#include "plugin_host/library.h"
#include "plugin_host/objects.h"
#include "trials/scene_facts.h"

namespace relign::conformance {

using plugin_host::Choice;
using plugin_host::Kind;
using plugin_host::Manifest;

namespace {

const char* const kProcess = "it runs as a process and has no library";

// The entry of the library without checks; load_library would refuse some of them.
const relign_plugin_description& raw_entry(const Manifest& manifest) {
  void* library = nullptr;
  {
    const plugin_host::FloatingPointGuard guard(manifest.id);
    library = ::dlopen(manifest.library.c_str(), RTLD_NOW | RTLD_LOCAL);
  }
  if (!library) {
    const char* reason = ::dlerror();
    throw Error(ErrorKind::plugin_rejected,
                std::string("the system cannot load the library: ") + (reason ? reason : "unknown reason"));
  }
  const void* entry = ::dlsym(library, RELIGN_PLUGIN_ENTRY_SYMBOL);
  if (!entry) throw Error(ErrorKind::plugin_rejected, "the library does not export " RELIGN_PLUGIN_ENTRY_SYMBOL);
  return *static_cast<const relign_plugin_description*>(entry);
}

Finding found_changes(const std::vector<std::string>& changes) {
  return changes.empty() ? ok() : failed(join(changes, "; "));
}

bool is_about_floating_point(const std::string& sentence) {
  return sentence.find("floating-point") != std::string::npos;
}

// One short round of typical work, in an object that is reused if possible.
std::function<void()> typical_work(const Subject& subject) {
  const Choice& choice = subject.choice();
  if (subject.kind() != Kind::scene) return [&subject] { exercise(subject.choice(), subject.scene.get()); };
  auto scene = std::make_shared<plugin_host::Scene>(choice, check_services());
  auto facts = std::make_shared<trials::SceneFacts>(trials::read_scene_facts(scene->describe(), choice.id));
  auto pixels = std::make_shared<std::vector<float>>(std::size_t{facts->image_width} * facts->image_height);
  if (facts->owns_stage)
    return [scene, facts, pixels] {
      scene->begin(1);
      scene->move_by(std::vector<double>(facts->axes.size(), 0.001));
      scene->capture(pixels->data());
    };
  return [scene, facts, pixels] {
    plugin_host::MountedAssembly assembly = scene->mount("{}");
    assembly.capture(facts->nominal_pose, 1, pixels->data());
    assembly.noise_free_mse(facts->nominal_pose, 2);
  };
}

}  // namespace

Finding check_library(const Subject& subject) {
  if (!is_library(*subject.manifest)) return skipped(kProcess);
  if (const std::string problem = plugin_host::check_shared_library(subject.manifest->library); !problem.empty())
    return failed(problem);
  raw_entry(*subject.manifest);
  return ok();
}

Finding check_symbols(const Subject& subject) {
  if (!is_library(*subject.manifest)) return skipped(kProcess);
  std::vector<std::string> more;
  for (const std::string& name : exported_symbols(subject.manifest->library))
    if (name != RELIGN_PLUGIN_ENTRY_SYMBOL) more.push_back(name);
  if (more.empty()) return ok();
  // The author's own names first, then those of the standard library.
  std::stable_partition(more.begin(), more.end(), [](const std::string& name) { return name.rfind("_Z", 0) != 0; });
  const std::string names = more.size() <= 3
                                ? join(more, ", ")
                                : more[0] + ", " + more[1] + " and " + std::to_string(more.size() - 2) + " more";
  return failed(
      "besides " RELIGN_PLUGIN_ENTRY_SYMBOL " it exports " + names +
      "; build it with relign_add_plugin, which hides them, because they could replace symbols of other plugins");
}

Finding check_manifest(const Subject& subject) {
  if (!is_library(*subject.manifest)) return skipped(kProcess);
  const relign_plugin_description& entry = raw_entry(*subject.manifest);
  if (!RELIGN_HAS_MEMBER(&entry, manifest_json) || !entry.manifest_json)
    return failed("the library contains no manifest");
  if (subject.manifest->text != entry.manifest_json)
    return failed("the manifest in " + subject.manifest->folder.string() +
                  " differs from the one inside the library; build the plugin again");
  return ok();
}

Finding check_interface(const Subject& subject) {
  if (!is_library(*subject.manifest)) return skipped(kProcess);
  const Manifest& manifest = *subject.manifest;
  if (subject.kind() == Kind::scene)
    plugin_host::plugin_interface(manifest, RELIGN_SCENE_INTERFACE, sizeof(std::uint32_t));
  else if (subject.kind() == Kind::noise_level)
    plugin_host::plugin_interface(manifest, RELIGN_NOISE_LEVEL_INTERFACE, sizeof(std::uint32_t));
  else
    plugin_host::plugin_interface(manifest, RELIGN_ALGORITHM_INTERFACE, sizeof(std::uint32_t));
  return ok();
}

Finding check_creates(const Subject& subject) {
  if (subject.choices.empty())
    return skipped("its defaults are incomplete (" + subject.incomplete + ") and it has no preset");
  for (const Choice& choice : subject.choices) {
    at("'" + choice.id + "'");
    if (subject.kind() == Kind::scene)
      plugin_host::Scene made(choice, check_services());
    else if (subject.kind() == Kind::noise_level)
      plugin_host::NoiseLevel made(choice, check_services());
    else
      plugin_host::Algorithm made(choice, check_services());
  }
  if (!subject.incomplete.empty())
    return ok("checked with its presets; without one it needs values: " + subject.incomplete);
  return ok();
}

Finding check_floating_point(const Subject& subject) {
  // The host guards loading, where the start-up code of -ffast-math changes the mode. This is not a fault if the plugin
  // does not change the mode later.
  if (is_library(*subject.manifest)) raw_entry(*subject.manifest);
  plugin_host::EnvironmentWatch watch;
  exercise(subject.choice(), subject.scene.get());
  std::vector<std::string> changes;
  for (const std::string& sentence : watch.changes())
    if (is_about_floating_point(sentence)) changes.push_back(sentence);
  return found_changes(changes);
}

Finding check_surroundings(const Subject& subject) {
  plugin_host::EnvironmentWatch watch;
  const ProcessState before;
  exercise(subject.choice(), subject.scene.get());
  std::vector<std::string> changes;
  for (const std::string& sentence : watch.changes())
    if (!is_about_floating_point(sentence)) changes.push_back(sentence);
  for (const std::string& sentence : before.environment_changes()) changes.push_back(sentence);
  // The first round may open files for the lifetime of the process (a device, a library's log); later ones may not.
  const ProcessState settled;
  exercise(subject.choice(), subject.scene.get());
  for (const std::string& sentence : settled.descriptor_changes()) changes.push_back(sentence);
  return found_changes(changes);
}

Finding check_stdout(const Subject& subject) {
  const std::string text = stdout_of([&] { exercise(subject.choice(), subject.scene.get()); });
  if (text.empty()) return ok();
  const std::string line = text.substr(0, std::min<std::size_t>(text.find('\n'), 60));
  return failed("it writes to stdout: '" + line +
                "'; use the log or stderr, because stdout is for the program's result");
}

Finding check_heap(const Subject& subject) {
  if (!is_library(*subject.manifest)) return skipped("it runs as a process");
  if (heap_bytes() == 0) return skipped("the allocator of this build does not report its memory");
  constexpr int kWarmUp = 10;
  constexpr int kHalf = 25;
  constexpr std::size_t kMaxBytesPerRound = 512;  // bytes
  const auto work = typical_work(subject);
  // In a thread of its own: malloc caches blocks per thread, which count as allocated and grow in number with new
  // sizes.
  const auto bytes_after = [&work](int rounds) {
    std::thread([&] {
      for (int round = 0; round < rounds; ++round) work();
    }).join();
    return heap_bytes();
  };
  const std::size_t start = bytes_after(kWarmUp);
  const std::size_t middle = bytes_after(kHalf);
  const std::size_t end = bytes_after(kHalf);
  // A leak grows in both halves, unlike a cache that fills once.
  const bool grows = middle > start + kHalf * kMaxBytesPerRound && end > middle + kHalf * kMaxBytesPerRound;
  if (!grows) return ok();
  return failed("its memory grew by " + std::to_string((end - start) / (2 * kHalf)) + " bytes with each of " +
                std::to_string(2 * kHalf) + (is_algorithm(subject.kind()) ? " trials" : " rounds"));
}

}  // namespace relign::conformance
