// An agent sees images and decides on moves. This one's policy is written by hand; put a trained one in its place.
#include <algorithm>
#include <relign/plugin.hpp>

namespace {

// Mean squared difference of neighbouring pixels: large when edges are sharp.
double sharpness(const relign::ImageView& image) {
  double sum = 0;
  for (std::size_t y = 0; y + 1 < image.height(); ++y)
    for (std::size_t x = 0; x + 1 < image.width(); ++x) {
      const double across = double{image.at(x + 1, y)} - image.at(x, y);
      const double down = double{image.at(x, y + 1)} - image.at(x, y);
      sum += across * across + down * down;
    }
  return sum / (static_cast<double>(image.width()) * static_cast<double>(image.height()));
}

// Image in, move out: everything this agent has "learnt" is in here. A network would read its weights from a
// file beside the manifest (DATA in CMakeLists.txt, given.plugin_folder() in the constructor).
class Policy {
 public:
  Policy(std::size_t axes, double first_move) : move_(axes, 0.0), stride_(first_move) {}

  // The next move, relative to the current pose, from the image seen there.
  const relign::Pose& decide(const relign::ImageView& image) {
    const double seen = sharpness(image);
    const bool better = seen > best_;
    if (better) best_ = seen;
    if (going_back_ || better) {
      going_back_ = false;
      if (!better) try_the_next_one();
      std::fill(move_.begin(), move_.end(), 0.0);
      move_[axis_] = sign_ * stride_;
    } else {
      going_back_ = true;  // worse: undo the move
      for (double& coordinate : move_) coordinate = -coordinate;
    }
    return move_;
  }
  bool finished() const { return stride_ < 1e-4; }

 private:
  void try_the_next_one() {
    sign_ = -sign_;
    if (sign_ < 0) return;  // the same axis, the other way
    axis_ = (axis_ + 1) % move_.size();
    if (axis_ == 0) stride_ /= 2;
  }

  relign::Pose move_;
  double stride_;
  double best_ = -1;
  double sign_ = 1;
  std::size_t axis_ = 0;
  bool going_back_ = false;
};

class MyPlugin final : public relign::Agent {
 public:
  explicit MyPlugin(const relign::Parameters& given) : first_move_(given.number("first_move")) {}

  void run(relign::Trial& trial) override {
    Policy policy(trial.axes(), std::min(first_move_, trial.largest_move()));
    std::optional<relign::Observation> seen = trial.first();  // step 0: the capture at the start pose
    while (seen && !policy.finished()) seen = trial.move(policy.decide(seen->image()));
    // No recommendation of its own: an agent would glue where it is. trial.recommend(pose) says otherwise.
  }

 private:
  double first_move_;  // share of the travel
};

}  // namespace

RELIGN_PLUGIN(MyPlugin)
