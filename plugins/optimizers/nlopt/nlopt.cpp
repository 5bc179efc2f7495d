// NLopt's bounded searches without derivatives, local and global. See README.md.
#include <cmath>
#include <exception>
#include <nlopt.hpp>
#include <relign/plugin.hpp>

namespace {

struct Method {
  const char* name;
  nlopt::algorithm algorithm;
  bool global;
};

// README.md says why PRAXIS, NEWUOA with a box, ESCH and AGS are not here.
constexpr Method methods[] = {
    {"sbplx", nlopt::LN_SBPLX, false},   {"bobyqa", nlopt::LN_BOBYQA, false},
    {"cobyla", nlopt::LN_COBYLA, false}, {"neldermead", nlopt::LN_NELDERMEAD, false},
    {"direct", nlopt::GN_DIRECT, true},  {"direct-l", nlopt::GN_DIRECT_L, true},
    {"crs2", nlopt::GN_CRS2_LM, true},   {"isres", nlopt::GN_ISRES, true},
    {"mlsl", nlopt::G_MLSL_LDS, true},
};

const Method& method_from_name(const std::string& name) {
  for (const Method& method : methods)
    if (name == method.name) return method;
  throw std::invalid_argument("unknown method '" + name + "'");
}

// How many poses NLopt's populations have unless told otherwise; 0: the method has none.
std::size_t usual_population(nlopt::algorithm algorithm, std::size_t axes) {
  switch (algorithm) {
    case nlopt::GN_CRS2_LM:
      return 10 * (axes + 1);
    case nlopt::GN_ISRES:
      return 20 * (axes + 1);
    default:
      return 0;
  }
}

class NloptSearch final : public relign::Optimizer {
 public:
  explicit NloptSearch(const relign::Parameters& given)
      : method_(method_from_name(given.text("method"))),
        local_(method_from_name(given.text("local"))),
        stride_(given.number("first_stride")),
        tolerance_(given.number("tolerance")),
        population_(static_cast<std::size_t>(given.integer("population"))) {}

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
    if (method_.global) {  // goes on until the budget is spent
      search();
      return;
    }
    // NLopt ends when its moves get small or the noise confuses it. While there is budget, start
    // again from the best pose with half the stride.
    for (; stride_ >= tolerance_ && !stopped_; stride_ /= 2) search();
  }

 private:
  // One run of NLopt. Its own result is ignored: some methods return a point that is not the best.
  void search() {
    nlopt::opt search = prepare(method_);
    search.set_maxeval(static_cast<int>(std::min<unsigned>(talk_->budget(), 1u << 30)) + 1);
    if (method_.algorithm == nlopt::G_MLSL_LDS) search.set_local_optimizer(prepare(local_));
    if (const std::size_t poses = population()) search.set_population(static_cast<unsigned>(poses));
    // NLopt has one generator per thread, and the whole search runs in this one: what others draw changes nothing.
    nlopt::srand(relign::Random(talk_->seed()).bits());
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

  // Global methods have no stride, and NLopt's tolerances would end them where two poses happen to be close.
  nlopt::opt prepare(const Method& method) const {
    const std::size_t axes = best_pose_.size();
    nlopt::opt search(method.algorithm, static_cast<unsigned>(axes));
    search.set_lower_bounds(box_.lower);
    search.set_upper_bounds(box_.upper);
    if (method.global) return search;
    std::vector<double> first_moves(axes);
    for (std::size_t axis = 0; axis < axes; ++axis) {  // a trust region must fit into the box
      const double room = 0.45 * (box_.upper[axis] - box_.lower[axis]);
      first_moves[axis] = room > 0 ? std::min(stride_, room) : stride_;
    }
    search.set_initial_step(first_moves);
    search.set_xtol_abs(tolerance_);
    return search;
  }

  // NLopt's populations are made for thousands of merits: unless told, one is at most a third of the budget.
  std::size_t population() const {
    const std::size_t axes = best_pose_.size();
    if (population_ == 0) {
      const std::size_t usual = usual_population(method_.algorithm, axes);
      return std::min(usual, std::max<std::size_t>(talk_->budget() / 3, axes + 2));
    }
    if (method_.algorithm == nlopt::GN_CRS2_LM && population_ < axes + 1)
      throw std::invalid_argument("population: crs2 needs one more than there are axes, at least " +
                                  std::to_string(axes + 1));
    return population_;
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

  Method method_;
  Method local_;            // of mlsl
  double stride_;           // share of the travel
  double tolerance_;        // share of the travel
  std::size_t population_;  // 0: by the budget
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
