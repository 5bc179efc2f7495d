// Compass search: try one stride along every axis; halve the stride when none improves.
#include <relign/plugin.hpp>

class Compass final : public relign::Optimizer {
 public:
  explicit Compass(const relign::Parameters& given) : stride_(given.number("first_stride")) {}

  void run(relign::Trial& trial) override {
    const relign::Box box = trial.box();       // commanded coordinates, under every protocol
    relign::Observation best = trial.first();  // step 0: the capture at the start pose
    while (stride_ > 1e-4) {                   // smaller moves are below the resolution of the stage
      bool improved = false;
      for (std::size_t axis = 0; axis < best.pose.size(); ++axis) {
        for (const double sign : {+1.0, -1.0}) {
          relign::Pose candidate = best.pose;
          candidate[axis] += sign * stride_;
          const auto observation = trial.step(box.clamp(candidate));  // one move and one capture
          if (!observation) return;                                   // budget spent: not an error
          if (observation->merit >= best.merit) continue;             // observation->image(): float pixels
          best = *observation;
          improved = true;
          trial.recommend(best.pose);  // the pose at which to fix the lens
          break;
        }
      }
      if (!improved) stride_ /= 2;
    }
  }

 private:
  double stride_;  // share of the travel
};

RELIGN_PLUGIN(Compass)
