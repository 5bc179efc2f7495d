// NLopt's local searches without derivatives. See README.md.
#include <cmath>
#include <exception>
#include <nlopt.hpp>
#include <relign/plugin.hpp>

namespace {

// Only methods that use no random numbers: NLopt's generator is one for all (nlopt_srand).
nlopt::algorithm method_from_name(const std::string& name) {
  if (name == "sbplx") return nlopt::LN_SBPLX;
  if (name == "bobyqa") return nlopt::LN_BOBYQA;
  if (name == "cobyla") return nlopt::LN_COBYLA;
  if (name == "neldermead") return nlopt::LN_NELDERMEAD;
  throw std::invalid_argument("unknown method '" + name + "'");
}

class NloptSearch final : public relign::Optimizer {
 public:
  explicit NloptSearch(const relign::Parameters& given)
      : method_(method_from_name(given.text("method"))),
        stride_(given.number("first_stride")),
        tolerance_(given.number("tolerance")) {}

  void run(relign::Conversation& talk) override {
    talk_ = &talk;
    box_ = talk.box();
    const relign::Observation first = talk.first();
    best_pose_ = box_.clamp(first.pose);
    // The capture at the start pose is free, but counts only where the start lies in the box.
    if (std::isfinite(first.merit)) {
      worst_merit_ = first.merit;
      if (best_pose_ == first.pose) best_merit_ = first.merit;
    }
    // NLopt ends when its moves get small or the noise confuses it. While there is budget, start
    // again from the best pose with half the stride.
    for (; stride_ >= tolerance_ && !stopped_; stride_ /= 2) search();
  }

 private:
  // One run of NLopt. Its own result is ignored: some methods return a point that is not the best.
  void search() {
    const std::size_t axes = best_pose_.size();
    nlopt::opt search(method_, static_cast<unsigned>(axes));
    search.set_lower_bounds(box_.lower);
    search.set_upper_bounds(box_.upper);
    std::vector<double> first_moves(axes);
    for (std::size_t axis = 0; axis < axes; ++axis) {  // a trust region must fit into the box
      const double room = 0.45 * (box_.upper[axis] - box_.lower[axis]);
      first_moves[axis] = room > 0 ? std::min(stride_, room) : stride_;
    }
    search.set_initial_step(first_moves);
    search.set_xtol_abs(tolerance_);
    search.set_maxeval(static_cast<int>(std::min<unsigned>(talk_->budget(), 1u << 30)) + 1);
    search.set_min_objective(evaluate, this);
    evaluations_ = 0;
    relign::Pose pose = box_.clamp(best_pose_);
    double merit = 0;
    try {
      search.optimize(pose, merit);
    } catch (const nlopt::forced_stop&) {  // by evaluate
    } catch (const nlopt::roundoff_limited&) {
    } catch (const std::runtime_error&) {  // NLopt's general failure: what was measured stays
    }
    if (failure_) std::rethrow_exception(failure_);
  }

  // Called by NLopt. Its wrapper turns forced_stop into nlopt_force_stop; nothing else may leave.
  static double evaluate(const std::vector<double>& pose, std::vector<double>& /*gradient*/, void* self) {
    return static_cast<NloptSearch*>(self)->measure(pose);
  }

  double measure(const relign::Pose& asked) {
    // Merits that differ by many orders of magnitude can break a model: that search is over.
    for (const double value : asked)
      if (!std::isfinite(value)) throw nlopt::forced_stop();
    const relign::Pose pose = box_.clamp(asked);  // BOBYQA may leave the box by the last bit
    // NLopt begins at the best pose: its merit is known. Only then, so that every further call costs
    // budget and a search that turns in circles comes to an end.
    if (evaluations_++ == 0 && pose == best_pose_ && std::isfinite(best_merit_)) return best_merit_;
    try {
      if (!stopped_)
        if (const auto seen = talk_->step(pose)) return take(*seen);
    } catch (...) {
      failure_ = std::current_exception();
    }
    stopped_ = true;
    throw nlopt::forced_stop();
  }

  // The merit NLopt shall see. One that is no number counts as bad as the worst one seen, so that
  // the models of BOBYQA and COBYLA stay finite.
  double take(const relign::Observation& seen) {
    if (!std::isfinite(seen.merit)) return worst_merit_;
    worst_merit_ = std::max(worst_merit_, seen.merit);
    if (seen.merit < best_merit_) {
      best_merit_ = seen.merit;
      best_pose_ = seen.pose;
      talk_->recommend(best_pose_);
    }
    return seen.merit;
  }

  nlopt::algorithm method_;
  double stride_;     // share of the travel
  double tolerance_;  // share of the travel
  relign::Conversation* talk_ = nullptr;
  relign::Box box_;
  relign::Pose best_pose_;
  double best_merit_ = std::numeric_limits<double>::infinity();
  double worst_merit_ = 1;
  unsigned evaluations_ = 0;  // of this search
  bool stopped_ = false;
  std::exception_ptr failure_;
};

}  // namespace

RELIGN_PLUGIN(NloptSearch)
