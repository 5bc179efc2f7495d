#include "records/merge_manifest.h"

#include <algorithm>

#include "base/error.h"
#include "base/limits.h"
#include "base/text.h"
#include "records/instances.h"
#include "records/manifest_check.h"
#include "records/record.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

std::string counted(const std::map<std::string, std::size_t>& values) {
  std::vector<std::string> parts;
  for (const auto& [value, folders] : values)
    parts.push_back((value.empty() ? "unknown" : value) + " (" + std::to_string(folders) +
                    (folders == 1 ? " folder)" : " folders)"));
  return join(parts, ", ");
}

}  // namespace

int ManifestJoin::place_of(const Names& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

int ManifestJoin::algorithm(const std::string& name, const std::string& protocol) const {
  return place_of(algorithms_, method_key(name, protocol));
}

void ManifestJoin::add(const fs::path& folder, const Manifest& manifest) {
  if (!first_) {
    first_folder_ = folder;
    first_ = manifest;
    for (const ManifestScene& entry : manifest.scenes) scenes_.push_back(entry.name);
    for (const ManifestLevel& entry : manifest.noise_levels) levels_.push_back(entry.name);
    for (const ManifestMethod& entry : manifest.algorithms) algorithms_.push_back(entry.key());
  } else {
    join_lists(folder, manifest);
  }
  add_source(folder, manifest);
}

void ManifestJoin::join_lists(const fs::path& folder, const Manifest& manifest) {
  const std::string a = first_folder_.string(), b = folder.string();
  std::vector<std::string> different;
  if (first_->instance_set != manifest.instance_set)
    different =
        differing(*first_, manifest, {"instance_set", "seed", "commitment", "first_instance", "instances"}, a, b);
  for (const std::string& message : different_scenes_and_levels(*first_, manifest, true, a, b))
    different.push_back(message);
  // Not part of the instance set, but results that differ in them are not comparable.
  for (const std::string& message : differing(*first_, manifest, {"limits", "machine_time", "cycle", "cost"}, a, b))
    different.push_back(message);
  if (!different.empty())
    throw Error(ErrorKind::bad_input,
                "cannot merge " + a + " and " + b + ": their scenes, noise levels, instances or limits differ:\n  " +
                    join(different, "\n  ") + "\nmake the suites equal in this and run one of them again");
  for (const ManifestMethod& entry : manifest.algorithms) {
    const int place = place_of(algorithms_, entry.key());
    if (place < 0) {
      algorithms_.push_back(entry.key());
      first_->algorithms.push_back(entry);
      continue;
    }
    ManifestMethod& known = first_->algorithms[static_cast<std::size_t>(place)];
    const auto other = differing(known, entry, {"plugin", "parameters", "merit", "steps"}, a, b);
    if (!other.empty())
      throw Error(ErrorKind::bad_input, "algorithm " + entry.label() + " of " + b +
                                            " differs from the algorithm of this name in the other folders:\n  " +
                                            join(other, "\n  ") +
                                            "\ngive one of them another \"name\" in its suite and run it again");
    // A suite that lists the algorithm overrides one where it was added automatically.
    known.added = known.added && entry.added;
  }
  if (!manifest.secret.empty()) first_->secret = manifest.secret;
  if (first_->spec != manifest.spec) other_specs_.push_back(b);
  if (json_of(first_->analysis) != json_of(manifest.analysis)) other_analyses_.push_back(b);
  for (const Pretrained& entry : manifest.prepared)
    if (std::find(first_->prepared.begin(), first_->prepared.end(), entry) == first_->prepared.end())
      first_->prepared.push_back(entry);
}

std::size_t ManifestJoin::suite_number(const StoredSuite& suite) {
  const auto found = std::find(suites_.begin(), suites_.end(), suite);
  if (found != suites_.end()) return static_cast<std::size_t>(found - suites_.begin());
  suites_.push_back(suite);
  return suites_.size() - 1;
}

void ManifestJoin::count(const MergeSource& source) {
  const Machine& machine = source.machine;
  if (std::none_of(processors_.begin(), processors_.end(),
                   [&machine](const Machine& one) { return one.same_processor(machine); }))
    processors_.push_back(machine);
  ++cpus_[machine.cpu];
  ++flags_[source.program.flags];
  for (const auto* hashes : {&source.plugins.scenes, &source.plugins.noise_levels, &source.plugins.algorithms})
    for (const auto& [name, hash] : *hashes) plugins_[name].insert(hash);
}

void ManifestJoin::add_source(const fs::path& folder, const Manifest& manifest) {
  MergeSource source;
  const auto add = [this](const auto& entries, std::map<std::string, std::string>& hashes) {
    for (const PluginEntry& entry : entries) {
      if (entry.on_this_cpu_only()) this_cpu_.insert(entry.name);
      hashes[entry.name] = entry.plugin_hash;
    }
  };
  add(manifest.scenes, source.plugins.scenes);
  add(manifest.noise_levels, source.plugins.noise_levels);
  add(manifest.algorithms, source.plugins.algorithms);

  // Replaces a merged folder by the folders that it was made of.
  for (MergeSource inner : manifest.sources) {
    if (inner.suite < manifest.suites.size()) inner.suite = suite_number(manifest.suites[inner.suite]);
    inner.by_way_of = folder.string();
    count(inner);
    sources_.push_back(std::move(inner));
  }
  own_source_.push_back(manifest.sources.empty() ? sources_.size() : kNoSource);
  if (!manifest.sources.empty()) return;
  source.folder = folder.string();
  source.suite = suite_number({manifest.suite_name, manifest.suite_file, manifest.suite});
  source.program = manifest.program;
  source.earlier_programs = manifest.earlier_programs;
  source.machine = manifest.machine;
  source.command = manifest.command;
  source.shard = manifest.shard;
  source.sandbox = manifest.sandbox;
  count(source);
  sources_.push_back(std::move(source));
}

bool ManifestJoin::may_differ_by_cpu(const std::string& scene, const std::string& level,
                                     const std::string& algorithm) const {
  return processors_.size() > 1 && (this_cpu_.count(scene) || this_cpu_.count(level) || this_cpu_.count(algorithm));
}

unsigned ManifestJoin::shards() const {
  for (const MergeSource& source : sources_)
    if (!source.shard || source.shard->plan != sources_.front().shard->plan) return 0;
  // At most as many as trials: bounds the memory for a damaged file.
  return sources_.empty() ? 0 : static_cast<unsigned>(std::min<std::uint64_t>(sources_.front().shard->of, kMaxTrials));
}

std::vector<unsigned> ManifestJoin::missing_shards() const {
  std::set<std::uint64_t> present;
  for (const MergeSource& source : sources_)
    if (source.shard) present.insert(source.shard->number);
  std::vector<unsigned> missing;
  for (unsigned number = 0, all = shards(); number < all; ++number)
    if (!present.count(number)) missing.push_back(number);
  return missing;
}

std::size_t ManifestJoin::sandboxed_sources() const {
  return static_cast<std::size_t>(std::count_if(sources_.begin(), sources_.end(),
                                                [](const MergeSource& source) { return source.sandbox.has_value(); }));
}

std::vector<std::string> ManifestJoin::notes(const Manifest& joined) const {
  std::vector<std::string> messages;
  if (const std::size_t inside = sandboxed_sources(); inside > 0 && inside < sources_.size())
    messages.push_back("algorithms ran in a sandbox in " + std::to_string(inside) + " of " +
                       std::to_string(sources_.size()) + " folders");
  if (cpus_.size() > 1)
    messages.push_back("results from several processors; host times are not comparable: " + counted(cpus_));
  if (flags_.size() > 1) messages.push_back("relign-bench was built with different flags: " + counted(flags_));
  if (!other_specs_.empty())
    messages.push_back("using the spec of " + first_folder_.string() + "; a different one is in " +
                       join(other_specs_, ", "));
  if (!other_analyses_.empty())
    messages.push_back("using the analysis plan of " + first_folder_.string() + "; a different one, or none, is in " +
                       join(other_analyses_, ", "));
  if (const std::string note = joined.builds_note(); !note.empty()) messages.push_back(note);
  for (const auto& [name, hashes] : plugins_)
    if (hashes.size() > 1)
      messages.push_back("plugin of '" + name + "': " + std::to_string(hashes.size()) +
                         " versions of its library; see \"sources\" in manifest.json");
  return messages;
}

Manifest ManifestJoin::joined(const std::vector<std::size_t>& taken) const {
  Manifest manifest = *first_;
  manifest.order.clear();
  manifest.shard.reset();
  manifest.earlier_programs.clear();
  manifest.suites = suites_;
  manifest.sources = sources_;
  if (sandboxed_sources() < sources_.size()) manifest.sandbox.reset();
  for (std::size_t folder = 0; folder < own_source_.size() && folder < taken.size(); ++folder)
    if (own_source_[folder] != kNoSource) manifest.sources[own_source_[folder]].trials = taken[folder];
  return manifest;
}

}  // namespace relign::records
