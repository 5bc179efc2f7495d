#include "records/merge_pictures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "base/error.h"
#include "base/files.h"
#include "base/inside.h"
#include "records/picture_index.h"
#include "records/record.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

// Copies `file` from a source's folder `root`. Ignores files outside of it, whether by name or behind a link.
void copy_once(const fs::path& root, const fs::path& file, const fs::path& to) {
  std::error_code code;
  const fs::path from = root / file;
  if (!is_inside(from, root) || !is_inside(to / file, to)) return;
  if (!fs::is_regular_file(from, code) || fs::exists(to / file, code)) return;
  fs::create_directories((to / file).parent_path(), code);
  if (code) throw_cannot_write((to / file).parent_path(), code);
  if (!fs::copy_file(from, to / file, code) && code) throw_cannot_write(to / file, code);
}

struct Pictured {
  PicturedTrial entry;
  std::uint32_t source = 0;
  double score = 0;
  std::uint64_t instance = 0;
};

// Score by which the runner chooses, too: noise-free MSE at the last recommendation; on a station, the lowest measured
// RMSE.
double score_of(const TrialRecord& trial) {
  if (trial.steps.empty()) return std::numeric_limits<double>::infinity();
  double score = trial.steps.back().recommended_mse;
  if (!std::isnan(score)) return score;
  for (const StepRecord& step : trial.steps) score = std::fmin(score, step.measured);
  return std::isnan(score) ? std::numeric_limits<double>::infinity() : score;
}

class PictureJoin {
 public:
  PictureJoin(const MergeIndex& index, const fs::path& out) : index_(index), out_(out), reader_(index.files) {
    for (std::uint32_t at = 0; at < index.trials.size(); ++at) by_id_.push_back(at);
    std::sort(by_id_.begin(), by_id_.end(),
              [&index](std::uint32_t a, std::uint32_t b) { return index.trials[a].id < index.trials[b].id; });
  }

  // The trial, if the index took its record from this source; else null.
  const FoundTrial* taken(const std::string& trial, std::uint32_t source) const {
    if (trial.empty() || trial.size() > PackedId().size()) return nullptr;
    const PackedId id = packed(trial, "");
    const auto found =
        std::lower_bound(by_id_.begin(), by_id_.end(), id,
                         [this](std::uint32_t at, const PackedId& wanted) { return index_.trials[at].id < wanted; });
    if (found == by_id_.end() || index_.trials[*found].id != id || index_.trials[*found].source != source)
      return nullptr;
    return &index_.trials[*found];
  }

  void copy_logs(std::uint32_t source) const {
    const fs::path folder = index_.sources[source] / "logs";
    std::error_code code;
    for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code))
      if (entry->path().extension() == ".txt" && taken(entry->path().stem().string(), source))
        copy_once(folder, entry->path().filename(), out_ / "logs");
  }

  void copy_scenes(std::uint32_t source) const {
    const fs::path folder = index_.sources[source] / "scenes";
    std::error_code code;
    for (fs::recursive_directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code))
      if (entry->is_regular_file(code) && !is_temporary_file(entry->path()))
        copy_once(folder, entry->path().lexically_relative(folder), out_ / "scenes");
  }

  void read_pictures(std::uint32_t source) {
    const fs::path folder = index_.sources[source] / "pictures";
    const PictureIndex pictures = read_picture_index(index_.sources[source]);
    for (const ReferencePicture& reference : pictures.references) {
      if (reference.file.empty() || !is_inside(folder / reference.file, folder)) continue;
      copy_once(folder, reference.file, out_ / "pictures");
      if (std::find(joined_.references.begin(), joined_.references.end(), reference) == joined_.references.end())
        joined_.references.push_back(reference);
    }
    for (const PicturedTrial& entry : pictures.trials) {
      const FoundTrial* trial = taken(entry.trial, source);
      if (!trial) continue;
      const auto group = std::make_tuple(trial->place.scene, trial->place.level, trial->place.algorithm);
      groups_[group][entry.why].push_back(
          {entry, source, score_of(reader_.record(trial->file, trial->block)), trial->place.instance});
    }
  }

  void write() {
    for (auto& [group, reasons] : groups_)
      for (const char* why : {"best", "median", "worst"}) {
        std::vector<Pictured>& all = reasons[why];
        if (all.empty()) continue;
        std::sort(all.begin(), all.end(), [](const Pictured& a, const Pictured& b) {
          return std::make_pair(a.score, a.instance) < std::make_pair(b.score, b.instance);
        });
        const bool best = std::string_view(why) == "best", worst = std::string_view(why) == "worst";
        const Pictured& one = best ? all.front() : worst ? all.back() : all[(all.size() - 1) / 2];
        const fs::path folder = index_.sources[one.source] / "pictures";
        for (const PictureFrame& frame : one.entry.frames) copy_once(folder, frame.file, out_ / "pictures");
        if (one.entry.film) copy_once(folder, one.entry.film->file, out_ / "pictures");
        joined_.trials.push_back(one.entry);
      }
    if (!joined_.trials.empty() || !joined_.references.empty()) write_picture_index(out_, joined_);
  }

 private:
  const MergeIndex& index_;
  fs::path out_;
  BlockReader reader_;
  std::vector<std::uint32_t> by_id_;
  PictureIndex joined_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, std::map<std::string, std::vector<Pictured>>>
      groups_;
};

}  // namespace

void copy_files(const MergeIndex& index, const fs::path& out) {
  PictureJoin join(index, out);
  for (std::uint32_t source = 0; source < index.sources.size(); ++source) {
    join.copy_logs(source);
    join.copy_scenes(source);
    join.read_pictures(source);
  }
  join.write();
}

}  // namespace relign::records
