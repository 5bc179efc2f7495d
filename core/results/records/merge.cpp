#include "records/merge.h"

#include <algorithm>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/json_members.h"
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

std::vector<PackedId> take_order(Json& manifest, const fs::path& folder) {
  const std::string file = (folder / "manifest.json").string();
  const auto order = manifest.find("order");
  if (order == manifest.end() || !order->is_array())
    throw Error(ErrorKind::bad_input, file + " is damaged: expected a list 'order'");
  // The merged manifest counts anew, so that the contradiction would disappear there.
  if (manifest.contains("trials") && count_of(manifest, "trials") != order->size())
    throw Error(ErrorKind::bad_input, in_quotes(file) + " contradicts itself: 'trials' is " +
                                          std::to_string(count_of(manifest, "trials")) + ", but 'order' has " +
                                          std::to_string(order->size()));
  std::vector<PackedId> ids;
  ids.reserve(order->size());
  for (const Json& id : *order) {
    if (!id.is_string())
      throw Error(ErrorKind::bad_input, file + " is damaged: expected trial ids in 'order', found " + id.dump());
    ids.push_back(packed(id.get_ref<const std::string&>(), file));
  }
  manifest.erase("order");
  return ids;
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

Json to_json(const Disagreement& one) {
  Json difference = {{"line", one.difference.closing ? "closing" : "step"},
                     {"field", one.difference.field},
                     {"kept", one.difference.was},
                     {"other", one.difference.is}};
  if (!one.difference.closing) difference["step"] = one.difference.step;
  return {{"trial", one.trial},
          {"label", one.label},
          {"kept", one.kept.string()},
          {"other", one.other.string()},
          {"difference", std::move(difference)}};
}

// Writes the list of ids as text: a million of them as JSON values would take more memory than all the rest.
void write_manifest(const fs::path& folder, const Json& manifest, const std::vector<PackedId>& order) {
  std::string text = manifest.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
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

void add_manifest(ManifestJoin& manifests, const fs::path& folder, Json manifest) {
  manifest.erase("order");  // may have millions of trials
  manifests.add(folder, std::move(manifest));
}

}  // namespace

Json to_json(const MergeSummary& summary) {
  Json list = Json::array();
  for (const Disagreement& one : summary.disagreements) list.push_back(to_json(one));
  Json json = {{"trials", summary.trials},
               {"missing", summary.missing},
               {"duplicates", summary.duplicates},
               {"within_tolerance", summary.within_tolerance},
               {"not_compared", summary.not_compared},
               {"superseded", summary.superseded},
               {"half_written", summary.half_written},
               {"left_out", summary.left_out},
               {"disagreeing", summary.disagreeing},
               {"disagreements", std::move(list)}};
  if (summary.shards > 0) {
    json["shards"] = summary.shards;
    json["missing_shards"] = summary.missing_shards;
  }
  return json;
}

void require_mergeable(const fs::path& folder, Json manifest, const std::vector<fs::path>& others) {
  ManifestJoin manifests;
  add_manifest(manifests, folder, std::move(manifest));
  for (const fs::path& other : others) add_manifest(manifests, other, read_manifest(other));
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
  for (const fs::path& folder : folders) add_manifest(manifests, folder, read_manifest(folder));
  std::vector<Damage> damaged;  // another folder may have these trials
  if (!options.checked)
    for (const fs::path& folder : folders) require_checked(folder, options.plan, "cannot merge", &damaged);
  for (const fs::path& folder : folders) {
    std::vector<PackedId> order;
    {
      Json manifest = read_manifest(folder);
      order = take_order(manifest, folder);
    }
    index.add(folder, order, manifests, summary);
  }
  throw_if_damaged(only_in(damaged, index.damaged));
  resolve_duplicates(index, manifests, summary);
  take_damaged_from_others(index, options);
  summary.trials = index.trials.size();
  summary.missing = index.missing.size();
  summary.shards = manifests.shards();
  summary.missing_shards = manifests.missing_shards();
  const std::vector<PackedId> order = write_lines(index, fresh.path());

  std::vector<std::size_t> taken(folders.size(), 0);
  for (const FoundTrial& trial : index.trials) ++taken[trial.source];
  index.times.clear();
  index.times.shrink_to_fit();
  copy_files(index, fresh.path());
  Json manifest = manifests.joined(taken);
  manifest["trials"] = order.size();
  manifest["merge"] = to_json(summary);
  manifest["command"] = options.command;
  write_manifest(fresh.path(), manifest, order);
  fresh.put_in_place();
  if (options.on_message)
    for (const std::string& note : manifests.notes()) options.on_message(note);
  return summary;
}

}  // namespace relign::records
