// nlopt: NLopt's derivative-free methods with bounds, local and global. See README.md.
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

// README.md lists the reasons for omitting PRAXIS, NEWUOA with bounds, ESCH and AGS.
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
  throw std::invalid_argument("parameter 'method': unknown method '" + name + "'");
}

// NLopt's default population; 0: the method has none.
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

  void run(relign::Trial& trial) override {
    trial_ = &trial;
    box_ = trial.box();
    const relign::Observation first = trial.first();
    best_pose_ = box_.clamp(first.pose);
    // The capture at the start pose is free, but counts only if the start is inside the box.
    if (std::isfinite(first.merit)) {
      worst_merit_ = first.merit;
      if (best_pose_ == first.pose) best_merit_ = first.merit;
    }
    if (method_.global) {  // runs until the budget is spent
      search();
      return;
    }
    // A local search ends when its steps become small, or because of noise. Restart from the best pose with half the
    // stride while budget remains.
    for (; stride_ >= tolerance_ && !stopped_; stride_ /= 2) search();
  }

 private:
  // One run of NLopt. Its result is ignored, because some methods return a point that is not the best.
  void search() {
    nlopt::opt search = prepare(method_);
    search.set_maxeval(static_cast<int>(std::min<unsigned>(trial_->budget(), 1u << 30)) + 1);
    if (method_.algorithm == nlopt::G_MLSL_LDS) search.set_local_optimizer(prepare(local_));
    if (const std::size_t poses = population()) search.set_population(static_cast<unsigned>(poses));
    // NLopt has one generator per thread, and the search runs in this thread, so other trials do not affect it.
    nlopt::srand(relign::Random(trial_->seed()).bits());
    search.set_min_objective(evaluate, this);
    evaluations_ = 0;
    relign::Pose pose = box_.clamp(best_pose_);
    double merit = 0;
    try {
      search.optimize(pose, merit);
    } catch (const nlopt::forced_stop&) {  // thrown by evaluate
    } catch (const nlopt::roundoff_limited&) {
    } catch (const std::runtime_error&) {  // NLopt's generic failure; measurements so far remain valid
    }
    if (failure_) std::rethrow_exception(failure_);
  }

  // Global methods have no stride, and NLopt's tolerances would end them as soon as two poses are close.
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

  // NLopt's default populations suit thousands of evaluations; by default a population is at most a third of the
  // budget.
  std::size_t population() const {
    const std::size_t axes = best_pose_.size();
    if (population_ == 0) {
      const std::size_t usual = usual_population(method_.algorithm, axes);
      return std::min(usual, std::max<std::size_t>(trial_->budget() / 3, axes + 2));
    }
    if (method_.algorithm == nlopt::GN_CRS2_LM && population_ < axes + 1)
      throw std::invalid_argument("parameter 'population': found '" + std::to_string(population_) +
                                  "', crs2 needs at least " + std::to_string(axes + 1) + " (axes + 1)");
    return population_;
  }

  // Called by NLopt. Its wrapper converts forced_stop into nlopt_force_stop; no other exception may escape.
  static double evaluate(const std::vector<double>& pose, std::vector<double>& /*gradient*/, void* self) {
    return static_cast<NloptSearch*>(self)->measure(pose);
  }

  double measure(const relign::Pose& asked) {
    // Merits that differ by many orders of magnitude can break a model; end the search then.
    for (const double value : asked)
      if (!std::isfinite(value)) throw nlopt::forced_stop();
    const relign::Pose pose = box_.clamp(asked);  // BOBYQA may leave the box by rounding
    // The first evaluation is at the best pose, whose merit is known. All further calls cost budget, so that a cycling
    // search ends.
    if (evaluations_++ == 0 && pose == best_pose_ && std::isfinite(best_merit_)) return best_merit_;
    try {
      if (!stopped_)
        if (const auto observation = trial_->step(pose)) return take(*observation);
    } catch (...) {
      failure_ = std::current_exception();
    }
    stopped_ = true;
    throw nlopt::forced_stop();
  }

  // Updates the incumbent and returns the merit for NLopt. A non-finite merit is replaced by the worst finite one, so
  // that the models of BOBYQA and COBYLA stay finite.
  double take(const relign::Observation& observation) {
    if (!std::isfinite(observation.merit)) return worst_merit_;
    worst_merit_ = std::max(worst_merit_, observation.merit);
    if (observation.merit < best_merit_) {
      best_merit_ = observation.merit;
      best_pose_ = observation.pose;
      trial_->recommend(best_pose_);
    }
    return observation.merit;
  }

  Method method_;
  Method local_;            // of mlsl
  double stride_;           // share of the travel
  double tolerance_;        // share of the travel
  std::size_t population_;  // 0: from the budget
  relign::Trial* trial_ = nullptr;
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
