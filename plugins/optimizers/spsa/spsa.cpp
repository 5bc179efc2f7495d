// spsa: simultaneous perturbation stochastic approximation (Spall 1992). See README.md.
#include <cmath>
#include <relign/plugin.hpp>

namespace {

// base^-exponent for base >= 1, with the same bits for every C library, unlike std::pow.
double decay(double base, double exponent) { return relign::portable_exp(-exponent * relign::portable_log(base)); }

class Spsa final : public relign::Optimizer {
 public:
  explicit Spsa(const relign::Parameters& given)
      : perturbation_(given.number("perturbation")),
        stride_(given.number("first_stride")),
        alpha_(given.number("alpha")),
        gamma_(given.number("gamma")),
        stability_(given.number("stability")),
        gradients_(static_cast<unsigned>(given.integer("gradients"))),
        average_(given.text("recommend") == "average") {}

  void run(relign::Trial& trial) override {
    box_ = trial.box();
    iterate_ = box_.clamp(trial.first().pose);
    relign::Random random(trial.seed());
    const unsigned iterations = std::max(1u, trial.budget() / gradients_ / 2);
    const double offset = stability_ * iterations;
    for (unsigned k = 0; k < iterations; ++k) {
      const double c = perturbation_ * decay(k + 1.0, gamma_);
      if (!measure_gradient(trial, random, c)) return;
      // a_k = a / (A + k + 1)^alpha, with `a` such that an average slope moves the first iterate by the stride.
      const double gain = stride_ * decay((offset + k + 1) / (offset + 1), alpha_);
      advance(gain);
      recommend(trial, k + 1, iterations);
    }
  }

 private:
  // Writes the mean of `gradients_` two-sided differences to gradient_. Returns false when the trial is over.
  bool measure_gradient(relign::Trial& trial, relign::Random& random, double c) {
    const std::size_t axes = iterate_.size();
    gradient_.assign(axes, 0);
    relign::Pose centre = iterate_;
    relign::Pose reach(axes);
    for (std::size_t axis = 0; axis < axes; ++axis) {
      // The centre is moved so that both captures of a difference are inside the box (Sadegh 1997).
      reach[axis] = std::min(c, 0.25 * (box_.upper[axis] - box_.lower[axis]));
      centre[axis] = std::clamp(centre[axis], box_.lower[axis] + reach[axis], box_.upper[axis] - reach[axis]);
    }
    unsigned usable = 0;
    for (unsigned repeat = 0; repeat < gradients_; ++repeat) {
      relign::Pose sign(axes);
      for (double& s : sign) s = random.bits() >> 31 ? 1 : -1;  // +-1 with equal probability, from the top bit
      relign::Pose ahead(axes);
      relign::Pose behind(axes);
      for (std::size_t axis = 0; axis < axes; ++axis) {
        ahead[axis] = centre[axis] + sign[axis] * reach[axis];
        behind[axis] = centre[axis] - sign[axis] * reach[axis];
      }
      const auto high = trial.step(box_.clamp(ahead));  // the sums may leave the box by rounding
      if (!high) return false;
      const double high_merit = high->merit;
      const auto low = trial.step(box_.clamp(behind));
      if (!low) return false;
      const double slope = (high_merit - low->merit) / (2 * c);
      if (!std::isfinite(slope)) continue;
      ++usable;
      learn_scale(std::fabs(slope));
      for (std::size_t axis = 0; axis < axes; ++axis)
        if (reach[axis] > 0) gradient_[axis] += slope * sign[axis] * (c / reach[axis]);
    }
    if (usable > 1)
      for (double& component : gradient_) component /= usable;
    return true;
  }

  // The unit of the merit is unknown: the mean of the first slopes is used as scale. It is then fixed, so that steps
  // shrink with the slope near the optimum.
  void learn_scale(double slope) {
    if (slopes_ == scale_slopes) return;
    scale_ += (slope - scale_) / ++slopes_;
  }

  void advance(double gain) {
    if (!(scale_ > 0) || !std::isfinite(scale_)) return;  // all slopes were 0
    for (std::size_t axis = 0; axis < iterate_.size(); ++axis) {
      const double move = gain * (gradient_[axis] / scale_);
      if (std::isnan(move)) continue;
      // Moves are limited to the first stride, so that a slope of pure noise cannot throw the iterate across the box.
      iterate_[axis] =
          std::clamp(iterate_[axis] - std::clamp(move, -stride_, stride_), box_.lower[axis], box_.upper[axis]);
    }
  }

  void recommend(relign::Trial& trial, unsigned made, unsigned iterations) {
    if (!average_ || made <= iterations / 2) {
      trial.recommend(iterate_);
      return;
    }
    // Polyak-Ruppert averaging over the second half of the iterates.
    if (averaged_ == 0) mean_.assign(iterate_.size(), 0);
    ++averaged_;
    for (std::size_t axis = 0; axis < mean_.size(); ++axis) mean_[axis] += (iterate_[axis] - mean_[axis]) / averaged_;
    trial.recommend(box_.clamp(mean_));
  }

  static constexpr unsigned scale_slopes = 4;

  double perturbation_;  // share of the travel
  double stride_;        // share of the travel
  double alpha_;
  double gamma_;
  double stability_;
  unsigned gradients_;
  bool average_;
  relign::Box box_;
  relign::Pose iterate_;
  relign::Pose gradient_;
  relign::Pose mean_;
  unsigned averaged_ = 0;
  double scale_ = 0;
  unsigned slopes_ = 0;
};

}  // namespace

RELIGN_PLUGIN(Spsa)
