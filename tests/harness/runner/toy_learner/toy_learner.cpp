// An algorithm with pretraining: saves its sources, numbers of samples and merits. In a trial it recommends nothing and
// logs what it loaded. Parameters: "forgets" saves nothing; "trips_on" fails, "crashes_on" crashes and "hangs_on" hangs
// on that source.
#include <chrono>
#include <cstdlib>
#include <relign/plugin.hpp>
#include <string>
#include <thread>

namespace {

class ToyLearner final : public relign::Optimizer {
 public:
  explicit ToyLearner(const relign::Parameters& given)
      : host_(given),
        forgets_(given.boolean("forgets")),
        trips_on_(given.integer("trips_on")),
        crashes_on_(given.integer("crashes_on")),
        hangs_on_(given.integer("hangs_on")),
        bytes_(static_cast<std::size_t>(given.integer("bytes"))) {}

  void run(relign::Trial& trial) override {
    const relign::Pretraining pretraining = trial.pretraining();
    const std::string before = pretraining.load().value_or("nothing");
    if (!pretraining.active()) {
      host_.warn("loaded " + before.substr(0, 1000));
      trial.step(relign::Pose(trial.axes(), 0.1));
      return;
    }
    if (static_cast<int>(pretraining.source()) == trips_on_) throw std::runtime_error("tripped");
    if (static_cast<int>(pretraining.source()) == crashes_on_) std::abort();
    while (static_cast<int>(pretraining.source()) == hangs_on_) std::this_thread::sleep_for(std::chrono::seconds(1));
    std::string seen = before + "; source " + std::to_string(pretraining.source()) + " of " +
                       std::to_string(pretraining.sources()) + " seed " + std::to_string(trial.seed());
    relign::Pose pose(trial.axes(), 0.5);
    while (const auto observed = trial.step(pose)) seen += " " + std::to_string(observed->merit);
    if (!forgets_) pretraining.save(seen + std::string(bytes_, '.'));
  }

 private:
  relign::Parameters host_;
  bool forgets_;
  std::int64_t trips_on_;
  std::int64_t crashes_on_;
  std::int64_t hangs_on_;
  std::size_t bytes_;
};

}  // namespace

RELIGN_PLUGIN(ToyLearner)
