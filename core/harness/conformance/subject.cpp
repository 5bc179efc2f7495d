#include "conformance/subject.h"

#include <algorithm>

#include "base/error.h"
#include "base/files.h"

namespace relign::conformance {

using plugin_host::Choice;
using plugin_host::Kind;
using plugin_host::Manifest;
using plugin_host::Parameter;
using plugin_host::Preset;

namespace {

constexpr int kSmallImage = 40;

// The manifest's "check" parameters, and parameters that make a scene fast to render if it declares them.
Json parameters_of_check(const Manifest& manifest) {
  Json given = manifest.check;
  if (manifest.kind != Kind::scene) return given;
  const Parameter* pixels = manifest.parameter("pixels");
  if (pixels && plugin_host::check_parameter(*pixels, kSmallImage).empty()) given["pixels"] = kSmallImage;
  return given;
}

}  // namespace

Subject open_subject(const std::filesystem::path& plugin) {
  plugin_host::Catalog catalog;
  catalog.add(plugin);
  Subject subject;
  subject.manifest = catalog.plugins().front();  // the only one
  const Manifest& manifest = *subject.manifest;
  const Json given = parameters_of_check(manifest);
  // Inner algorithms are found by name; the checks replace them by a walk.
  const bool names_others = std::any_of(manifest.parameters.begin(), manifest.parameters.end(), [](const Parameter& p) {
    return p.type == plugin_host::ParameterType::algorithm;
  });
  if (names_others)
    for (const std::filesystem::path& root : plugin_host::Catalog::default_roots()) catalog.scan(root);

  std::vector<Problem> problems;
  if (Choice choice = catalog.resolve(manifest.kind, manifest.id, given, ".", problems); choice.plugin)
    subject.choices.push_back(std::move(choice));
  for (const Problem& problem : problems)
    subject.incomplete += (subject.incomplete.empty() ? "" : "; ") + problem.message;
  for (const Preset& preset : manifest.presets) {
    problems.clear();
    Choice choice = catalog.resolve(manifest.kind, preset.id, given, ".", problems);
    std::string mistakes;
    for (const Problem& problem : problems) mistakes += "\n  " + problem.to_string();
    if (!choice.plugin)
      throw Error(ErrorKind::plugin_rejected, "preset '" + preset.id + "' of '" + manifest.id + "':" + mistakes);
    subject.choices.push_back(std::move(choice));
  }
  return subject;
}

plugin_host::HostServices check_services(unsigned threads) {
  plugin_host::HostServices services;
  services.threads = threads;
  services.cache_folder = relign::cache_folder();
  return services;
}

}  // namespace relign::conformance
