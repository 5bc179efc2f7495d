#include "runner/pictures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "base/fault.h"
#include "base/files.h"
#include "base/seeds.h"
#include "images/image_file.h"
#include "plugin_host/packed.h"
#include "records/picture_index.h"
#include "records/results_folder.h"
#include "records/stored_trials.h"
#include "runner/kept_result.h"
#include "runner/scene_files.h"
#include "runner/trial_runner.h"

namespace relign::runner {
namespace fs = std::filesystem;

namespace {

constexpr unsigned kFilmTile = 80;  // pixels
constexpr std::size_t kFilmFrames = 8;

std::string film_name() { return "film.webp"; }

// Indices of the steps in a film: the first, the last, and more near the beginning, where the pose changes most.
std::vector<std::size_t> film_frames(std::size_t steps) {
  std::set<std::size_t> places;
  const std::size_t frames = std::min(kFilmFrames, steps);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const double share = frames == 1 ? 0 : static_cast<double>(frame) / static_cast<double>(frames - 1);
    places.insert(static_cast<std::size_t>(std::lround(std::expm1(std::log(static_cast<double>(steps)) * share))));
  }
  for (std::size_t place = 0; places.size() < frames; ++place)
    places.insert(place);  // fills up where rounding gave equal indices
  return {places.begin(), places.end()};
}

struct Chosen {
  records::TrialRecord record;
  const char* why;
};

// Data for choosing trials; the steps of chosen ones are read later.
struct Candidate {
  double score;
  std::uint64_t instance;
  records::StoredTrial where;
};

// Noise-free MSE at the recommended pose of the last step; where it is unknown, the lowest measured RMSE.
double score_of(const std::vector<records::StepNumbers>& steps) {
  double score = steps.back().recommended_mse;
  if (!std::isnan(score)) return score;
  for (const records::StepNumbers& step : steps) score = std::fmin(score, step.measured);
  return std::isnan(score) ? std::numeric_limits<double>::infinity() : score;
}

class Pictures {
 public:
  Pictures(const PreparedPlan& prepared, const fs::path& results, const PictureOptions& options)
      : prepared_(prepared),
        results_(results),
        options_(options),
        runner_({options.threads, options.cache_folder, {}, options.stop}) {}

  void write() {
    for (std::size_t place = 0; place < prepared_.plan.trials.size(); ++place)
      planned_.emplace(prepared_.plan.trials[place].id, &prepared_.plan.trials[place]);
    const std::vector<Chosen> chosen = choose_all();
    // Sorted by scene and instance, so that each lens is mounted once.
    std::vector<const Chosen*> captures;
    for (const Chosen& one : chosen) captures.push_back(&one);
    std::stable_sort(captures.begin(), captures.end(), [this](const Chosen* a, const Chosen* b) {
      const auto key = [this](const Chosen* one) {
        const suites::PlannedTrial& trial = *planned_.at(one->record.trial);
        return std::make_tuple(trial.scene, trial.level, trial.instance);
      };
      return key(a) < key(b);
    });
    std::size_t scene = prepared_.plan.suite.scenes.size();
    for (const Chosen* one : captures) {
      if (stopped()) return;
      const suites::PlannedTrial& trial = *planned_.at(one->record.trial);
      if (trial.scene != scene) write_scene(scene = trial.scene);
      if (prepared_.scenes[trial.scene].owns_stage) continue;    // stored during the trial
      if (!prepared_.scenes[trial.scene].has_image()) continue;  // the steps have all that there is to see
      guarded([&] { capture(make_job(prepared_, trial), one->record); });
    }
    remove_strangers(chosen);
    write_index(chosen);
  }

 private:
  bool stopped() const { return options_.stop && options_.stop->load(); }

  template <class Body>
  void guarded(Body&& body) {
    try {
      body();
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::plugin_failed) throw;
      if (options_.on_message) options_.on_message(std::string("cannot capture a picture: ") + error.what());
    }
  }

  std::vector<Chosen> choose_all() {
    std::vector<std::vector<Candidate>> groups;  // in the plan's order
    using Group = std::tuple<std::size_t, std::size_t, std::size_t>;
    std::map<Group, std::size_t> place;
    for (const suites::PlannedTrial& trial : prepared_.plan.trials)
      if (place.emplace(Group(trial.scene, trial.level, trial.algorithm), groups.size()).second) groups.emplace_back();
    records::for_each_with_steps(results_, [&](const records::TrialRecord& closing, const records::StoredTrial& where,
                                               const std::vector<records::StepNumbers>& steps) {
      const auto found = planned_.find(closing.trial);
      if (found == planned_.end() || !records::ended_well(closing.end) || steps.empty()) return;
      const suites::PlannedTrial& trial = *found->second;
      groups[place.at(Group(trial.scene, trial.level, trial.algorithm))].push_back(
          {score_of(steps), closing.instance, where});
    });
    std::vector<Chosen> all;
    for (std::vector<Candidate>& group : groups) choose(group, all);
    return all;
  }

  // Best, median and worst by score; a single trial is all three. Ties go to the lower instance, so that the choice
  // does not depend on the order.
  void choose(std::vector<Candidate>& trials, std::vector<Chosen>& all) const {
    if (trials.empty()) return;
    std::sort(trials.begin(), trials.end(), [](const Candidate& a, const Candidate& b) {
      return std::make_pair(a.score, a.instance) < std::make_pair(b.score, b.instance);
    });
    const auto add = [&](const Candidate& one, const char* why) {
      all.push_back({records::read_stored(results_, one.where), why});
    };
    add(trials.front(), "best");
    add(trials[(trials.size() - 1) / 2], "median");
    add(trials.back(), "worst");
  }

  void write_scene(std::size_t scene) {
    const suites::SceneEntry& entry = prepared_.plan.suite.scenes[scene];
    const trials::SceneFacts& facts = prepared_.scenes[scene];
    const fs::path own = results_ / scene_folder(prepared_, scene);
    const fs::path shown = results_ / "pictures" / entry.name / "reference.png";
    if (!fs::exists(own / "description.json")) write_file_atomically(own / "description.json", facts.text);
    if (options_.draw_lens && !fs::exists(own / "lens.svg"))
      if (const std::string drawing = options_.draw_lens(entry.choice); !drawing.empty())
        write_file_atomically(own / "lens.svg", drawing);
    TrialJob job;
    job.scene = entry.choice;
    job.scene_name = entry.name;
    if (!fs::exists(own / "landscape.json"))
      guarded([&] {
        const KeptResult kept(options_.cache_folder, "landscape", key_of_scene(prepared_, scene));
        Json landscape = kept.read();
        if (landscape.is_null()) {
          landscape = measure_landscape(runner_.scene(job), facts, options_.stop);
          kept.write(landscape);
        }
        if (!landscape.is_null()) write_file_atomically(own / "landscape.json", landscape.dump() + "\n");
      });
    if (!facts.has_image() || (fs::exists(own / "reference.png") && fs::exists(shown))) return;
    guarded([&] {
      const images::Image reference =
          trials::picture_of(facts, plugin_host::packed(runner_.scene(job).reference()).data());
      fs::create_directories(shown.parent_path());
      images::write_preview(own / "reference.png", reference, static_cast<float>(facts.image_white));
      images::write_preview(shown, reference, static_cast<float>(facts.image_white));
    });
  }

  // Captures the start with the noise of step 0, and the last recommendation with the noise of the last step.
  void capture(const TrialJob& job, const records::TrialRecord& record) {
    const fs::path folder = results_ / "pictures" / record.trial;
    const records::StepRecord& last = record.steps.back();
    const auto white = static_cast<float>(job.facts.image_white);
    const auto preview = [&](unsigned step, const std::vector<double>& true_pose) {
      const fs::path file = folder / frame_name(step);
      if (!fs::exists(file)) images::write_preview(file, seen(job, true_pose, step), white);
    };
    preview(0, record.steps.front().true_pose);
    if (last.step > 0) preview(last.step, last.recommended_true_pose);
    if (fs::exists(folder / film_name())) return;
    std::vector<images::Image> film;
    for (const std::size_t place : film_frames(record.steps.size()))
      film.push_back(seen(job, record.steps[place].true_pose, record.steps[place].step, record.steps[place].regions));
    images::write_film(folder / film_name(), film, kFilmTile, white);
  }

  images::Image seen(const TrialJob& job, const std::vector<double>& true_pose, unsigned step,
                     const PixelRegions& regions = {}) {
    const TrialRunner::Placed placed = runner_.place(job);
    images::Image frame(job.facts.image_width, job.facts.image_height);
    const std::uint64_t seed = frame_seed(placed.instance.seed, step, FrameStream::capture);
    if (regions.empty()) {
      placed.assembly->capture(true_pose, seed, frame.values.data());
    } else {
      images::Image read = frame;
      placed.assembly->capture_regions(true_pose, seed, plugin_host::regions_of(regions), read.values.data());
      for (const PixelSpan& span : spans_of(regions, frame.width))
        std::copy_n(read.values.begin() + static_cast<std::ptrdiff_t>(span.first), span.count,
                    frame.values.begin() + static_cast<std::ptrdiff_t>(span.first));
    }
    return trials::picture_of(job.facts, frame.values.data());
  }

  void remove_strangers(const std::vector<Chosen>& chosen) {
    std::set<std::string> wanted;
    for (const Chosen& one : chosen) wanted.insert(one.record.trial);
    for (const suites::SceneEntry& scene : prepared_.plan.suite.scenes) wanted.insert(scene.name);
    for (const auto& [id, trial] : planned_)  // a later run may choose different trials
      if (prepared_.scenes[trial->scene].owns_stage) wanted.insert(id);
    std::vector<fs::path> strangers;
    std::error_code code;
    for (fs::directory_iterator entry(results_ / "pictures", code), end; !code && entry != end; entry.increment(code))
      if (entry->is_directory() && !wanted.count(entry->path().filename().string())) strangers.push_back(entry->path());
    for (const fs::path& stranger : strangers) fs::remove_all(stranger, code);
  }

  // With the data shown beside each frame, so that a page does not need to read the records.
  static records::FilmEntry film_entry(const records::TrialRecord& record, const SceneScore& score) {
    records::FilmEntry film{record.trial + "/" + film_name(), kFilmTile, {}};
    for (const std::size_t place : film_frames(record.steps.size())) {
      const records::StepRecord& step = record.steps[place];
      film.frames.push_back({step.step, step.commanded_pose, step.true_pose, step.measured,
                             score.shown(step.commanded_mse), score.shown(step.recommended_mse), step.machine_seconds});
    }
    return film;
  }

  void write_index(const std::vector<Chosen>& chosen) {
    records::PictureIndex index;
    for (const Chosen& one : chosen) {
      const records::TrialRecord& record = one.record;
      const trials::SceneFacts& facts = prepared_.scenes[planned_.at(record.trial)->scene];
      if (!facts.has_image()) continue;
      records::PicturedTrial& entry = index.trials.emplace_back();
      entry.trial = record.trial;
      entry.scene = record.scene;
      entry.noise_level = record.noise_level;
      entry.protocol = record.protocol;
      entry.algorithm = record.algorithm;
      entry.instance = record.instance;
      entry.why = one.why;
      entry.shows = facts.owns_stage ? "last_capture" : "recommended";
      const auto add = [&](unsigned step) {
        const std::string file = record.trial + "/" + frame_name(step);
        if (fs::exists(results_ / "pictures" / file)) entry.frames.push_back({step, file});
      };
      add(0);
      if (record.steps.back().step > 0) add(record.steps.back().step);
      if (fs::exists(results_ / "pictures" / record.trial / film_name())) entry.film = film_entry(record, facts.score);
    }
    for (const suites::SceneEntry& scene : prepared_.plan.suite.scenes)
      if (fs::exists(results_ / "pictures" / scene.name / "reference.png"))
        index.references.push_back({scene.name, scene.name + "/reference.png"});
    records::write_picture_index(results_, index);
  }

  const PreparedPlan& prepared_;
  fs::path results_;
  const PictureOptions& options_;
  TrialRunner runner_;
  std::map<std::string, const suites::PlannedTrial*> planned_;
};

}  // namespace

void write_pictures(const PreparedPlan& prepared, const fs::path& results, const PictureOptions& options) {
  try {
    Pictures(prepared, results, options).write();
  } catch (const fs::filesystem_error& error) {
    throw Error(ErrorKind::io, "cannot write the pictures: " + fault_text(error));
  }
}

}  // namespace relign::runner
