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
#include <relign/basics.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
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

class Measures;
class Prior;
class History;
class Model;
class Pretraining;
struct RunOutcome;

// The host's side of one trial. See relign_trial for the rules.
class Trial {
 public:
  explicit Trial(const relign_trial* trial) : trial_(trial) {}

  std::size_t axes() const { return trial_->task->axes; }
  unsigned budget() const { return trial_->task->budget; }
  std::uint64_t seed() const { return trial_->task->seed; }
  bool observes(std::uint32_t bits) const { return (trial_->task->observes & bits) == bits; }
  double largest_move() const { return trial_->task->largest_move; }

  // The box to search, in commanded coordinates, under every protocol.
  Box box() const {
    const relign_task* task = trial_->task;
    if (!task->box_lower || !task->box_upper)
      throw std::logic_error("no box was granted: declare \"box\" under \"observes\" in the manifest");
    return {Pose(task->box_lower, task->box_lower + task->axes), Pose(task->box_upper, task->box_upper + task->axes)};
  }

  // Step 0: the capture at the start pose. Costs nothing.
  Observation first() {
    relign_observation seen = empty();
    check(trial_->first(trial_->context, &seen), "first");
    return convert(seen);
  }

  // One move to an absolute commanded pose and one capture; nothing once the budget is spent.
  std::optional<Observation> step(const Pose& pose) { return request(trial_->step, pose, "step"); }

  // The same for a move relative to where the stage is.
  std::optional<Observation> move(const Pose& delta) { return request(trial_->move, delta, "move"); }

  // "I would glue here now."
  void recommend(const Pose& pose) {
    check(trial_->recommend(trial_->context, pose.data(), static_cast<std::uint32_t>(pose.size())), "recommend");
  }

  // The next capture reads out these regions only, and takes only their readout time: the other pixels are 0. False,
  // and nothing is selected: the scene captures whole frames only. Needs "images".
  bool select_regions(const std::vector<Region>& regions);

  // Services: what more a trial offers (relign/services.hpp). Each throws std::logic_error when the host does not offer
  // it; the message names what the manifest lacks.
  ImageView reference() const;      // O*; needs "images". Valid during run
  Measures measures() const;        // MTF, contrast, centroid, ... of the last capture; needs "images"
  Prior prior() const;              // draws from the noise level; needs "level"
  History history() const;          // inspection of earlier modules of the batch; needs "history"
  Model model() const;              // a simulator of the scene's design; needs "design"
  Pretraining pretraining() const;  // data from source instances; needs "prepare". Never throws
  // Hand-over: runs the algorithm that `parameter` (of type "algorithm") names for at most so many of my steps.
  RunOutcome run(std::string_view parameter, unsigned most_steps, std::string_view parameters_json = {});

  // Any service by its id; null when the host does not offer it.
  const void* service(std::string_view id) const {
    return trial_->get_service ? trial_->get_service(trial_->context, to_text(id)) : nullptr;
  }

 private:
  using Request = relign_status (*)(void*, const double*, std::uint32_t, relign_observation*);

  static relign_observation empty() {
    relign_observation seen{};
    seen.struct_size = sizeof seen;
    return seen;
  }
  std::optional<Observation> request(Request ask, const Pose& pose, const char* what) {
    relign_observation seen = empty();
    const relign_status status = ask(trial_->context, pose.data(), static_cast<std::uint32_t>(pose.size()), &seen);
    if (status == RELIGN_STOP) return std::nullopt;
    check(status, what);
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
  static void check(relign_status status, const char* what) {
    if (status == RELIGN_OK) return;
    if (status == RELIGN_BAD_ARGUMENT)
      throw std::invalid_argument(std::string(what) +
                                  ": the host refused the pose (wrong number of axes, or not finite)");
    throw std::runtime_error(std::string(what) + ": the host reports a failure");
  }
  template <class Service>
  const Service* offered(const char* id, std::uint32_t needed, const char* word) const;
  const relign_trial* trial_;
  std::shared_ptr<char> run_ = std::make_shared<char>();  // lives as long as run: what is kept longer can tell
};

}  // namespace relign

#endif  // RELIGN_TRIAL_HPP
