// relign/trial.hpp: the trial that an algorithm receives, and the observation that a step returns.
// Comes with relign/plugin.hpp; the rules are in relign/plugin.h at relign_trial.
#ifndef RELIGN_TRIAL_HPP
#define RELIGN_TRIAL_HPP

#include <relign/plugin.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <relign/services.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relign {

// One step as an algorithm sees it. A value: pose and merit may be kept; image() is a view that
// is valid until the next step of the trial.
struct Observation {
  unsigned step = 0;                                        // 0 = the capture at the start pose
  Pose pose;                                                // commanded
  double merit = std::numeric_limits<double>::quiet_NaN();  // smaller is better; NaN when not granted
  std::uint64_t limits_low = 0;                             // bit i: axis i met its lower limit
  std::uint64_t limits_high = 0;                            // bit i: axis i met its upper limit
  double machine_seconds = 0;

  ImageView image() const {
    if (!image_) throw std::logic_error("no image was granted: declare \"images\" under \"observes\" in the manifest");
    return ImageView(*image_);
  }

  const relign_image* image_ = nullptr;
};

// One field of a lens in the model. A place is NaN, and MTF 0, where no light arrives.
struct ModelField {
  double x_px, y_px;            // from the middle of the first column and of the top row
  double tangential, sagittal;  // MTF of the lens alone
};

// "relign.model/1": a simulator of the scene's design, with offsets and seeds of one's own.
class Model : public border::Service<relign_model_service> {
 public:
  // A lens in the model; unmounted by its destructor.
  class Lens;

  Model(const TrialTable& trial, const relign_model_service* table, std::weak_ptr<void> run)
      : Service(trial, table), run_(std::move(run)) {}

  std::string scene_json() const { return std::string(to_view(table_->scene_json)); }
  std::size_t width() const { return table_->image_width; }
  std::size_t height() const { return table_->image_height; }
  // R"({"L2": {"shift_mm": [0.01, 0, 0]}})"; "{}" is the perfect lens.
  inline Lens mount(std::string_view offsets_json) const;

 private:
  std::weak_ptr<void> run_;  // expired once run has returned
};

class Model::Lens {
 public:
  Lens(Model model, relign_model_lens* lens) : model_(std::move(model)), lens_(lens) {}
  Lens(Lens&& other) noexcept : model_(std::move(other.model_)), lens_(std::exchange(other.lens_, nullptr)) {}
  Lens& operator=(Lens&& other) noexcept {
    std::swap(model_, other.model_);
    std::swap(lens_, other.lens_);
    return *this;
  }
  ~Lens() {
    // After run the host has unmounted it already: an algorithm may have kept it in a member.
    if (lens_ && !model_.run_.expired()) model_.table_->unmount(model_.table_->context, lens_);
  }

  // Pixels row by row, row 0 on top. true_pose: 0..1 per axis, without any stage.
  std::vector<float> capture(const Pose& true_pose, std::uint64_t seed) const {
    std::vector<float> pixels = image();
    model_.check(model_.table_->capture(model_.table_->context, lens_, true_pose.data(), count_of(true_pose), seed,
                                        pixels.data()),
                 "model.capture");
    return pixels;
  }
  // Nothing when the scene offers no noise-free images.
  std::optional<std::vector<float>> noise_free(const Pose& true_pose) const {
    std::vector<float> pixels = image();
    if (!model_.done(model_.table_->noise_free(model_.table_->context, lens_, true_pose.data(), count_of(true_pose),
                                               pixels.data()),
                     "model.noise_free"))
      return std::nullopt;
    return pixels;
  }
  // An image without noise and its derivatives, one behind the other: the image, one by each axis (per whole travel),
  // five for each element by its offsets shift_mm x, y, z and tilt_deg x, y. From `samples` rays per pixel. elements:
  // numbers of different ones, in the order of the scene's "elements". Nothing when the scene does not offer it.
  std::optional<std::vector<float>> slopes(const Pose& true_pose, std::uint64_t seed, std::uint32_t samples,
                                           const std::vector<std::uint32_t>& elements = {}) const {
    std::vector<float> pixels(model_.width() * model_.height() * (true_pose.size() + 1 + 5 * elements.size()));
    if (!model_.done(model_.table_->slopes(model_.table_->context, lens_, true_pose.data(), count_of(true_pose), seed,
                                           samples, elements.data(), count_of(elements), pixels.data()),
                     "model.slopes"))
      return std::nullopt;
    return pixels;
  }
  // Where this lens images the fields of the scene, in their order, and how sharply, from rays. arguments_json:
  // R"({"cycles_per_pixel": 0.1})" or {"lp_per_mm": 50}. Nothing when the scene does not offer it.
  std::optional<std::vector<ModelField>> fields(const Pose& true_pose, std::string_view arguments_json) const {
    auto found = Model::empty<relign_model_fields>();
    if (!model_.done(model_.table_->fields(model_.table_->context, lens_, true_pose.data(), count_of(true_pose),
                                           to_text(arguments_json), &found),
                     "model.fields"))
      return std::nullopt;
    std::vector<ModelField> rows;
    for (std::uint32_t i = 0; i < found.count; ++i)
      rows.push_back({found.x_px[i], found.y_px[i], found.tangential[i], found.sagittal[i]});
    return rows;
  }
  // One measure of the last image that capture or noise_free made of this lens, as Measures::measure of a capture.
  double measure(std::string_view name, std::string_view arguments_json = {}) const {
    double value = 0;
    model_.check(model_.table_->measure(model_.table_->context, lens_, to_text(name), to_text(arguments_json), &value),
                 "model.measure");
    return value;
  }

 private:
  std::vector<float> image() const { return std::vector<float>(model_.width() * model_.height()); }
  Model model_;
  relign_model_lens* lens_;
};
using ModelLens = Model::Lens;

inline Model::Lens Model::mount(std::string_view offsets_json) const {
  relign_model_lens* lens = nullptr;
  check(table_->mount(table_->context, to_text(offsets_json), &lens), "model.mount");
  return Lens(*this, lens);
}

// "relign.prepared/1": pretraining on source instances, which are never benchmark instances. Not offered to a plugin
// whose manifest lacks "prepare": then there is nothing to load.
class Pretraining : public border::Service<relign_prepared_service> {
 public:
  using Service::Service;

  // On a source instance, where save() is possible.
  bool active() const { return table_ && table_->active != 0; }
  std::uint32_t source() const { return table_ ? table_->source : 0; }
  std::uint32_t sources() const { return table_ ? table_->sources : 0; }

  // In a trial the prepared data, on a source instance what the sources before left. Nothing when there is none; throws
  // when the pretraining failed. The bytes come from a file that anybody may have touched: check them.
  std::optional<std::string> load() const {
    border::Collector data;
    if (!table_ || !done(table_->load(table_->context, data.sink()), "prepared.load")) return std::nullopt;
    return data.text();
  }
  // Any bytes, in the place of what was there. Only on a source instance.
  void save(std::string_view data) const {
    if (!table_) throw std::logic_error("this host pretrains nothing: ask active() first");
    check(table_->save(table_->context, to_text(data)), "prepared.save");
  }
};

// What another algorithm did with some of my steps. Poses are mine to use.
struct RunOutcome {
  unsigned steps = 0;                  // used of the budget; 0 when none was left
  bool finished = false;               // it returned before its steps were used up
  std::optional<Observation> last;     // where the stage is now; nothing when no step was left
  std::optional<Observation> best;     // lowest merit; nothing unless "merit" is granted
  std::optional<Pose> recommendation;  // its recommended pose; counts only when I recommend it
};

// The host's side of one trial. See relign_trial for the rules.
class Trial : public TrialServices {
 public:
  using TrialServices::TrialServices;

  unsigned budget() const { return trial_->task->budget; }
  std::uint64_t seed() const { return trial_->task->seed; }
  double largest_move() const { return trial_->task->largest_move; }
  // [{"name": "loss", "unit": "dB"}, ...], as in the task; needs "images".
  std::string readings_json() const { return {trial_->task->readings_json.data, trial_->task->readings_json.size}; }

  // The box to search, in commanded coordinates, under every protocol.
  Box box() const {
    const relign_task* task = trial_->task;
    if (!task->box_lower || !task->box_upper)
      throw std::logic_error("no box was granted: declare \"box\" under \"observes\" in the manifest");
    return {Pose(task->box_lower, task->box_lower + task->axes), Pose(task->box_upper, task->box_upper + task->axes)};
  }

  // Step 0: the capture at the start pose. Costs nothing.
  Observation first() {
    auto seen = empty<relign_observation>();
    check_pose(trial_->first(trial_->context, &seen), "first");
    return convert(seen);
  }

  // One move to an absolute commanded pose and one capture; nothing once the budget is spent.
  std::optional<Observation> step(const Pose& pose) { return request(trial_->step, pose, "step"); }

  // The same for a move relative to where the stage is.
  std::optional<Observation> move(const Pose& delta) { return request(trial_->move, delta, "move"); }

  // "I would glue here now."
  void recommend(const Pose& pose) {
    check_pose(trial_->recommend(trial_->context, pose.data(), count_of(pose)), "recommend");
  }

  // O*; needs "images". Valid during run.
  ImageView reference() const {
    return ImageView(
        *offered<relign_reference_service>(RELIGN_SERVICE_REFERENCE, RELIGN_OBSERVES_IMAGES, "images")->image);
  }
  // A simulator of the scene's design; needs "design".
  Model model() const {
    return {*this, offered<relign_model_service>(RELIGN_SERVICE_MODEL, RELIGN_OBSERVES_DESIGN, "design"), run_};
  }
  // Data from source instances; needs "prepare". Never throws.
  Pretraining pretraining() const {
    return {*this, static_cast<const relign_prepared_service*>(service(RELIGN_SERVICE_PREPARED))};
  }
  // Hand-over: runs the algorithm that `parameter` (of type "algorithm") names for at most so many of my steps.
  RunOutcome run(std::string_view parameter, unsigned most_steps, std::string_view parameters_json = {}) {
    const auto* service = static_cast<const relign_run_service*>(this->service(RELIGN_SERVICE_RUN));
    if (!service)
      throw std::logic_error("the service " RELIGN_SERVICE_RUN
                             " is not offered: declare a parameter of type \"algorithm\" in the manifest");
    auto written = empty<relign_run_outcome>();
    const relign_status status =
        service->run(service->context, to_text(parameter), to_text(parameters_json), most_steps, &written);
    if (status == RELIGN_STOP) return {};
    check(status, "run");
    RunOutcome outcome;
    outcome.steps = written.steps;
    outcome.finished = written.end == RELIGN_RUN_FINISHED;
    if (written.last) outcome.last = convert(*written.last);
    if (written.best) outcome.best = convert(*written.best);
    if (written.recommendation) outcome.recommendation = Pose(written.recommendation, written.recommendation + axes());
    return outcome;
  }

 private:
  using Request = relign_status (*)(void*, const double*, std::uint32_t, relign_observation*);

  std::optional<Observation> request(Request ask, const Pose& pose, const char* what) {
    auto seen = empty<relign_observation>();
    const relign_status status = ask(trial_->context, pose.data(), count_of(pose), &seen);
    if (status == RELIGN_STOP) return std::nullopt;
    check_pose(status, what);
    return convert(seen);
  }
  Observation convert(const relign_observation& seen) const {
    Observation observation;
    observation.step = seen.step;
    observation.pose.assign(seen.pose, seen.pose + axes());
    observation.merit = seen.merit;
    observation.limits_low = seen.limits_low;
    observation.limits_high = seen.limits_high;
    observation.machine_seconds = seen.machine_seconds;
    observation.image_ = seen.image;
    return observation;
  }
  static void check_pose(relign_status status, const char* what) {
    if (status == RELIGN_OK) return;
    if (status == RELIGN_BAD_ARGUMENT)
      throw std::invalid_argument(std::string(what) +
                                  ": the host refused the pose (wrong number of axes, or not finite)");
    throw std::runtime_error(std::string(what) + ": the host reports a failure");
  }
  std::shared_ptr<char> run_ = std::make_shared<char>();  // lives as long as run: what is kept longer can tell
};

}  // namespace relign

#endif  // RELIGN_TRIAL_HPP
