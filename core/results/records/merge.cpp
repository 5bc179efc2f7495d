#include "records/merge.h"

#include <algorithm>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"
#include "records/fresh_folder.h"
#include "records/line_files.h"
#include "records/merge_index.h"
#include "records/merge_manifest.h"
#include "records/merge_pictures.h"
#include "records/results_folder.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

// Resolves links and dots, so that two names of one folder compare equal.
fs::path real(const fs::path& folder) {
  std::error_code code;
  const fs::path found = fs::weakly_canonical(folder, code);
  return code ? folder : found;
}

// Results folders; replaces a folder of shards by the shards in it.
std::vector<fs::path> expand(const MergeOptions& options) {
  std::vector<fs::path> folders;
  std::set<fs::path> known;
  const auto add = [&](const fs::path& folder) {
    if (known.insert(real(folder)).second) folders.push_back(folder);
  };
  for (const fs::path& source : options.sources) {
    std::error_code code;
    require_folder(source);
    if (fs::exists(source / "manifest.json", code)) {
      add(source);
      continue;
    }
    std::vector<fs::path> shards;
    for (fs::directory_iterator entry(source, code), end; !code && entry != end; entry.increment(code))
      if (entry->path().filename().string().rfind("shard-", 0) == 0 && fs::exists(entry->path() / "manifest.json"))
        shards.push_back(entry->path());
    if (shards.empty())
      throw Error(ErrorKind::bad_input,
                  source.string() +
                      " is not a results folder: it contains neither manifest.json nor folders shard-... with one");
    std::sort(shards.begin(), shards.end());
    for (const fs::path& shard : shards) add(shard);
  }
  return folders;
}

// The manifest, and the ids of its order, which may be millions.
std::pair<Manifest, std::vector<PackedId>> read_packed(const fs::path& folder) {
  Manifest manifest = manifest_of(folder);
  const std::string file = (folder / "manifest.json").string();
  // The merged manifest counts anew, so that the contradiction would disappear there.
  if (manifest.trials != manifest.order.size())
    throw Error(ErrorKind::bad_input, in_quotes(file) + " contradicts itself: 'trials' is " +
                                          std::to_string(manifest.trials) + ", but 'order' has " +
                                          std::to_string(manifest.order.size()));
  std::vector<PackedId> ids;
  ids.reserve(manifest.order.size());
  for (const std::string& id : manifest.order) ids.push_back(packed(id, file));
  manifest.order = {};
  return {std::move(manifest), std::move(ids)};
}

// Of lines that the index does not read, because their block has its checksum.
std::vector<Damage> only_in(const std::vector<Damage>& damaged, const std::vector<Damage>& known) {
  std::vector<Damage> others;
  for (const Damage& one : damaged)
    if (std::none_of(known.begin(), known.end(),
                     [&one](const Damage& other) { return other.file == one.file && other.line == one.line; }))
      others.push_back(one);
  return others;
}

// Damaged trials do not count. Throws Error(bad_input) unless another folder has them.
void take_damaged_from_others(const MergeIndex& index, const MergeOptions& options) {
  std::set<std::string> complete;
  if (!index.damaged.empty())
    for (const FoundTrial& trial : index.trials) complete.insert(unpacked(trial.id));
  std::vector<Damage> lost;
  for (const Damage& damage : index.damaged)
    if (damage.of_times || !complete.count(damage.trial)) lost.push_back(damage);
  throw_if_damaged(lost);
  if (!options.on_message) return;
  for (const Damage& damage : index.damaged) options.on_message(to_string(damage) + "; another folder has the trial");
}

// Writes line files of 1000 trials each, in the plan's order.
class LineFilesWriter {
 public:
  explicit LineFilesWriter(fs::path folder) : folder_(std::move(folder)) {}
  void add(std::size_t place, const std::string& block) {
    if (place / kTrialsPerFile != file_) {
      flush();
      file_ = place / kTrialsPerFile;
    }
    text_ += block;
    if (text_.size() > (std::size_t{8} << 20)) flush();
  }
  void flush() {
    // No flush to the disk: after a crash the sources still exist.
    if (!text_.empty()) append_block(folder_ / line_file_name(file_), text_, false);
    text_.clear();
  }

 private:
  fs::path folder_;
  std::size_t file_ = 0;
  std::string text_;
};

// Writes the trials and their times. Returns the ids in the plan's order, including missing trials.
std::vector<PackedId> write_lines(MergeIndex& index, const fs::path& folder) {
  std::stable_sort(index.times.begin(), index.times.end(), [](const FoundTimes& a, const FoundTimes& b) {
    return std::make_pair(a.id, a.source) < std::make_pair(b.id, b.source);
  });
  std::sort(index.missing.begin(), index.missing.end(),
            [](const MissingTrial& a, const MissingTrial& b) { return a.place < b.place; });
  BlockReader reader(index.files);
  LineFilesWriter trials(folder / "trials"), times(folder / "times");
  std::vector<PackedId> order;
  order.reserve(index.trials.size() + index.missing.size());
  auto missing = index.missing.begin();
  for (const FoundTrial& trial : index.trials) {
    for (; missing != index.missing.end() && missing->place < trial.place; ++missing) order.push_back(missing->id);
    const std::size_t place = order.size();
    order.push_back(trial.id);
    trials.add(place, reader.read(trial.file, trial.block));
    // The last line of a trial is the valid one.
    const auto after = std::upper_bound(index.times.begin(), index.times.end(), std::make_pair(trial.id, trial.source),
                                        [](const std::pair<PackedId, std::uint32_t>& wanted, const FoundTimes& one) {
                                          return wanted < std::make_pair(one.id, one.source);
                                        });
    if (after == index.times.begin()) continue;
    const FoundTimes& line = *(after - 1);
    if (line.id == trial.id && line.source == trial.source) times.add(place, reader.read(line.file, line.block));
  }
  for (; missing != index.missing.end(); ++missing) order.push_back(missing->id);
  trials.flush();
  times.flush();
  return order;
}

// Writes the list of ids as text: a million of them as JSON values would take more memory than all the rest.
void write_manifest(const fs::path& folder, const Manifest& manifest, const std::vector<PackedId>& order) {
  std::string text = json_of(manifest).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  const std::string empty = "\n  \"order\": []";
  const std::size_t at = text.find(empty);  // found only here: string values have no bare newline
  if (at == std::string::npos) throw Error(ErrorKind::internal, "a merged manifest has no place for its order");
  std::string list = "\n  \"order\": [";
  list.reserve(order.size() * 26 + 32);
  for (std::size_t place = 0; place < order.size(); ++place)
    list += (place == 0 ? "\n    " : ",\n    ") + Json(unpacked(order[place])).dump();
  list += order.empty() ? "]" : "\n  ]";
  text.replace(at, empty.size(), list);
  write_file_atomically(folder / "manifest.json", text);
}

}  // namespace

void require_mergeable(const fs::path& folder, const Manifest& manifest, const std::vector<fs::path>& others) {
  ManifestJoin manifests;
  manifests.add(folder, manifest);
  for (const fs::path& other : others) manifests.add(other, manifest_of(other));
}

MergeSummary merge(const MergeOptions& options) {
  MergeSummary summary;
  ManifestJoin manifests;
  MergeIndex index;
  const std::vector<fs::path> folders = expand(options);
  if (folders.empty()) throw Error(ErrorKind::bad_input, "nothing to merge: give at least one results folder");
  for (const fs::path& folder : folders)
    if (real(folder) == real(options.out))
      throw Error(ErrorKind::bad_input,
                  options.out.string() + " is one of the folders to merge; choose another output folder with --out");
  FreshFolder fresh(options.out);
  // All manifests first, so that incompatible folders are refused before a large file is read.
  std::vector<std::vector<PackedId>> orders;
  for (const fs::path& folder : folders) {
    auto [manifest, order] = read_packed(folder);
    manifests.add(folder, manifest);
    orders.push_back(std::move(order));
  }
  std::vector<Damage> damaged;  // another folder may have these trials
  if (!options.checked)
    for (const fs::path& folder : folders) require_checked(folder, options.plan, "cannot merge", &damaged);
  for (std::size_t i = 0; i < folders.size(); ++i)
    index.add(folders[i], std::exchange(orders[i], {}), manifests, summary);
  throw_if_damaged(only_in(damaged, index.damaged));
  resolve_duplicates(index, manifests, summary);
  take_damaged_from_others(index, options);
  summary.trials = index.trials.size();
  summary.missing = index.missing.size();
  summary.shards = manifests.shards();
  if (summary.shards > 0) summary.missing_shards = manifests.missing_shards();
  const std::vector<PackedId> order = write_lines(index, fresh.path());

  std::vector<std::size_t> taken(folders.size(), 0);
  for (const FoundTrial& trial : index.trials) ++taken[trial.source];
  index.times.clear();
  index.times.shrink_to_fit();
  copy_files(index, fresh.path());
  Manifest manifest = manifests.joined(taken);
  manifest.trials = order.size();
  manifest.merge = summary;
  manifest.command = options.command;
  write_manifest(fresh.path(), manifest, order);
  fresh.put_in_place();
  if (options.on_message)
    for (const std::string& note : manifests.notes(manifest)) options.on_message(note);
  return summary;
}

}  // namespace relign::records
