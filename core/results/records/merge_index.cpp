#include "records/merge_index.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <tuple>

#include "base/error.h"
#include "records/checksum.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

// Whether the steps of the failed attempt `early` are the first steps of the finished trial `whole`.
bool is_prefix(TrialRecord whole, TrialRecord early, double tolerance) {
  if (early.steps.size() > whole.steps.size()) return false;
  whole.steps.resize(early.steps.size());
  whole.end = early.end;
  whole.message = early.message;
  whole.warnings = early.warnings;
  // Known only at the end of a trial.
  if (std::isnan(early.own_optimum.mse)) whole.own_optimum = early.own_optimum;
  if (std::isnan(early.own_optimum.mtf.centre)) whole.own_optimum.mtf = {};
  whole.scores = early.scores;
  whole.criteria = early.criteria;
  whole.criterion_optimum_pose = early.criterion_optimum_pose;
  whole.criterion_optimum_deficit = early.criterion_optimum_deficit;
  return !first_difference(whole, early, tolerance);
}

}  // namespace

PackedId packed(const std::string& id, const std::string& place) {
  PackedId small{};
  if (id.empty() || id.size() > small.size())
    throw Error(ErrorKind::bad_input, place + ": invalid trial id '" + id + "'; expected 1 to 16 characters");
  std::copy(id.begin(), id.end(), small.begin());
  return small;
}

std::string unpacked(const PackedId& id) { return {id.data(), ::strnlen(id.data(), id.size())}; }

bool PlanPlace::operator<(const PlanPlace& other) const {
  return std::tie(scene, level, algorithm, instance, after) <
         std::tie(other.scene, other.level, other.algorithm, other.instance, other.after);
}

bool PlanPlace::same_trial(const PlanPlace& other) const {
  return std::tie(scene, level, algorithm, instance) ==
         std::tie(other.scene, other.level, other.algorithm, other.instance);
}

std::uint32_t MergeIndex::add_file(const fs::path& file) {
  files.push_back(file);
  return static_cast<std::uint32_t>(files.size() - 1);
}

void MergeIndex::add(const fs::path& folder, const std::vector<PackedId>& order, const ManifestJoin& manifests,
                     MergeSummary& summary) {
  const auto source = static_cast<std::uint32_t>(sources.size());
  sources.push_back(folder);
  std::vector<std::pair<PackedId, std::uint32_t>> planned;  // by id, with its place in `order`
  for (std::uint32_t at = 0; at < order.size(); ++at) planned.emplace_back(order[at], at);
  std::sort(planned.begin(), planned.end());
  const auto place_in_order = [&planned](const PackedId& id) {
    const auto found = std::lower_bound(planned.begin(), planned.end(), std::make_pair(id, std::uint32_t{0}));
    return found != planned.end() && found->first == id ? static_cast<std::ptrdiff_t>(found->second) : -1;
  };
  std::vector<PlanPlace> known(order.size());
  std::vector<bool> complete(order.size(), false);
  for (const fs::path& file : line_files(folder / "trials")) {
    const std::uint32_t number = add_file(file);
    const auto found = [&](const TrialRecord& closing, const BlockPlace& block) {
      const PackedId id = packed(closing.trial, file.string());
      const std::ptrdiff_t at = place_in_order(id);
      if (at < 0) {
        ++summary.left_out;
        return;
      }
      const int scene = manifests.scene(closing.scene), level = manifests.level(closing.noise_level),
                algorithm = manifests.algorithm(closing.algorithm, closing.protocol);
      if (scene < 0 || level < 0 || algorithm < 0)
        throw Error(ErrorKind::bad_input, file.string() + ": trial " + closing.trial + " (" + label_of(closing) +
                                              ") is not of a scene, noise level and algorithm in manifest.json");
      const PlanPlace place{static_cast<std::uint32_t>(scene), static_cast<std::uint32_t>(level),
                            static_cast<std::uint32_t>(algorithm), 0, closing.instance};
      known[static_cast<std::size_t>(at)] = place;
      complete[static_cast<std::size_t>(at)] = true;
      trials.push_back({id, place, source, number, block, ended_well(closing.end)});
    };
    scan_trials(file, damaged, found, [&summary](const std::string&) { ++summary.half_written; });
  }
  PlanPlace last;
  for (std::size_t at = 0; at < order.size(); ++at) {
    if (complete[at]) {
      last = known[at];
    } else {
      ++last.after;
      missing.push_back({order[at], last});
    }
  }
  for (const fs::path& file : line_files(folder / "times")) {
    const std::uint32_t number = add_file(file);
    scan_times(file, damaged, [&](const std::string& trial, const BlockPlace& block) {
      times.push_back({packed(trial, file.string()), source, number, block});
    });
  }
}

BlockReader::~BlockReader() {
  for (const std::uint32_t file : opened_) ::close(open_[file]);
}

const std::string& BlockReader::read(std::uint32_t file, const BlockPlace& place) {
  const auto fail = [this, file](const char* reason) {
    throw Error(ErrorKind::io, "cannot read '" + files_[file].string() + "': " + reason);
  };
  if (open_.size() < files_.size()) open_.resize(files_.size(), -1);
  if (open_[file] < 0) {
    constexpr std::size_t kMaxOpen = 200;  // a process may often have 1024
    if (opened_.size() == kMaxOpen) {
      ::close(open_[opened_.front()]);
      open_[opened_.front()] = -1;
      opened_.erase(opened_.begin());
    }
    open_[file] = ::open(files_[file].c_str(), O_RDONLY | O_CLOEXEC);
    if (open_[file] < 0) fail(std::strerror(errno));
    opened_.push_back(file);
  }
  text_.resize(place.size);
  for (std::size_t done = 0; done < place.size;) {
    const ssize_t got =
        ::pread(open_[file], text_.data() + done, place.size - done, static_cast<off_t>(place.offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(std::strerror(errno));
    if (got == 0) fail("it became shorter while it was read; is a run writing it?");
    done += static_cast<std::size_t>(got);
  }
  return text_;
}

TrialRecord BlockReader::record(std::uint32_t file, const BlockPlace& place) {
  const std::string text = read(file, place);
  Blocks split = split_trials(text, files_[file].string());
  throw_if_damaged(split.damaged);
  split.blocks.at(0).line = place.line;
  return read_block(split.blocks[0], files_[file].string());
}

namespace {

void compare_with_kept(MergeIndex& index, BlockReader& reader, const FoundTrial& kept, const FoundTrial& other,
                       const ManifestJoin& manifests, MergeSummary& summary, bool& disagrees) {
  const std::string bytes = without_checksum(reader.read(kept.file, kept.block));
  if (bytes == without_checksum(reader.read(other.file, other.block))) {
    ++summary.duplicates;
    return;
  }
  const std::string other_bytes = without_checksum(reader.read(other.file, other.block));
  TrialRecord was = reader.record(kept.file, kept.block), is = reader.record(other.file, other.block);
  const bool as_written = bytes == to_lines(was) + "\n" && other_bytes == to_lines(is) + "\n";
  std::set<std::string> cleared = clear_later(was, is);
  cleared.merge(clear_later(is, was));
  const double tolerance =
      manifests.may_differ_by_cpu(was.scene, was.noise_level, was.algorithm) ? kOtherCpuTolerance : 0;
  if (kept.ended_well && !other.ended_well && is_prefix(was, is, tolerance)) {
    ++summary.superseded;
    return;
  }
  std::optional<Difference> difference = first_difference(was, is, tolerance);
  if (!difference && tolerance > 0) {
    ++summary.duplicates;
    ++summary.within_tolerance;
    return;
  }
  if (!difference && as_written && !cleared.empty()) {
    ++summary.duplicates;
    for (const std::string& key : cleared) ++summary.not_compared[key];
    return;
  }
  // Equal numbers in different bytes: the file was edited.
  if (!difference) difference = Difference{true, 0, "bytes of the lines", "other", "other", 0};
  if (!disagrees) ++summary.disagreeing;
  disagrees = true;
  if (summary.disagreements.size() < kNamedDisagreements)
    summary.disagreements.push_back({was.trial, label_of(was), index.sources[kept.source].string(),
                                     index.sources[other.source].string(), *difference});
}

}  // namespace

void resolve_duplicates(MergeIndex& index, const ManifestJoin& manifests, MergeSummary& summary) {
  std::vector<FoundTrial>& trials = index.trials;
  std::sort(trials.begin(), trials.end(), [](const FoundTrial& a, const FoundTrial& b) {
    return std::make_tuple(a.id, !a.ended_well, a.source, a.file, a.block.offset) <
           std::make_tuple(b.id, !b.ended_well, b.source, b.file, b.block.offset);
  });
  BlockReader reader(index.files);
  std::size_t kept = 0;
  for (std::size_t at = 0; at < trials.size();) {
    const FoundTrial first = trials[at];
    bool disagrees = false;
    for (++at; at < trials.size() && trials[at].id == first.id; ++at)
      compare_with_kept(index, reader, first, trials[at], manifests, summary, disagrees);
    trials[kept++] = first;
  }
  trials.resize(kept);

  std::vector<MissingTrial>& missing = index.missing;
  const auto by_id = [](const MissingTrial& a, const MissingTrial& b) { return a.id < b.id; };
  std::sort(missing.begin(), missing.end(), by_id);
  missing.erase(std::unique(missing.begin(), missing.end(),
                            [](const MissingTrial& a, const MissingTrial& b) { return a.id == b.id; }),
                missing.end());
  missing.erase(std::remove_if(missing.begin(), missing.end(),
                               [&trials](const MissingTrial& one) {
                                 const auto found = std::lower_bound(
                                     trials.begin(), trials.end(), one.id,
                                     [](const FoundTrial& a, const PackedId& id) { return a.id < id; });
                                 return found != trials.end() && found->id == one.id;
                               }),
                missing.end());

  std::sort(trials.begin(), trials.end(), [](const FoundTrial& a, const FoundTrial& b) { return a.place < b.place; });
  for (std::size_t at = 1; at < trials.size(); ++at) {
    const FoundTrial &a = trials[at - 1], &b = trials[at];
    if (!a.place.same_trial(b.place)) continue;
    const TrialRecord one = reader.record(a.file, a.block);
    throw Error(ErrorKind::bad_input,
                "trial " + unpacked(a.id) + " of " + index.sources[a.source].string() + " and trial " + unpacked(b.id) +
                    " of " + index.sources[b.source].string() + " are both " + label_of(one) +
                    ", but with different data of the algorithm (such as a model file) or different settings in the "
                    "suites; give one of them another \"name\" in its suite and run it again");
  }
}

}  // namespace relign::records
