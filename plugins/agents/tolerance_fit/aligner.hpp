// Estimates, from all captures of a trial, the pose of the lens and its best pose.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "joint_fit.hpp"

namespace tolerance_fit {

class Aligner {
 public:
  // reference: pixels of the reference image. stray_light: fit gain, offset and stray light along.
  Aligner(std::shared_ptr<const Knowledge> known, relign::Model model, const std::vector<double>& reference,
          bool stray_light)
      : known_(std::move(known)),
        pictures_(std::move(model)),
        layout_(*known_),
        stray_(stray_light ? missing(reference) : std::vector<double>()),
        reference_(without_stray(reference, known_->fine)),
        blurred_reference_(without_stray(reference, known_->middle)),
        coarse_(*known_, pictures_, known_->coarse, {60, 60, 0.03}),
        middle_(*known_, pictures_, known_->middle, {20, 30, 0.01}),
        fine_(*known_, pictures_, known_->fine, {}),
        x_(Vector::Zero(layout_.size())),
        best_(known_->nominal),
        state_of_best_(layout_.state(x_)) {
    pictures_.set_offsets(known_->offsets, known_->offset_mean, known_->combinations);
  }

  void add(const relign::Observation& observation) {
    const Vector commanded = to_vector(observation.pose);
    const relign::ImageView image = observation.image();
    const std::size_t width = pictures_.size().width, height = pictures_.size().height;
    if (sites_.empty() || sites_.back().commanded != commanded) {
      sites_.push_back(
          {commanded, observation.limits_low, observation.limits_high, 0, std::vector<double>(width * height)});
      if (sites_.size() > kMaxSites) sites_.erase(sites_.begin());
    }
    Site& site = sites_.back();
    ++site.count;
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t x = 0; x < width; ++x) {
        const double pixel = image.at(x, y);
        site.sum[y * width + x] += std::isfinite(pixel) ? pixel : 0.0;
      }
  }

  // Fits the lens to the captures added so far and finds the best pose of the fitted lens.
  void update() {
    const bool coarse = !settled_ || !near();
    if (coarse) approach();
    if (!near()) return;
    const Vector before = x_;
    refine();
    if (misfit_ < kLost) return;
    // The fine fit failed: keep the result of the blurred images, or fit them now.
    x_ = before;
    if (coarse) return;
    approach();
    if (near()) refine();
  }

  Vector offsets() const { return known_->offset_mean + known_->combinations * layout_.state(x_); }  // mm, degrees
  Vector here() const { return layout_.pose(x_, sites_.back().commanded); }                          // true pose
  Vector target() const { return layout_.commanded(x_, best_); }                                     // commanded
  // Difference between a capture at the target and one at the current pose, in standard deviations of noise.
  double distance() const { return known_->distance(joined(best_ - here(), Vector::Zero(layout_.state(x_).size()))); }

 private:
  static constexpr std::size_t kMaxSites = 12;
  static constexpr double kStrayBlur = 2;  // bins: stray light is smooth, the noise of rendered images is not

  // The reference image minus the design's image at the nominal pose: light that the model lacks. It moves with the
  // image, but less than it is wide while captures are near the best pose.
  std::vector<double> missing(const std::vector<double>& reference) {
    pictures_.set_offsets({}, Vector(), Matrix::Zero(0, 0));
    const std::vector<float> clean = pictures_.pixels(known_->nominal, Vector(), 0);
    std::vector<double> stray(reference.size());
    for (std::size_t i = 0; i < stray.size(); ++i) stray[i] = reference[i] - static_cast<double>(clean[i]);
    return stray;
  }
  Vector stray(Detail detail) const {
    if (stray_.empty()) return {};
    detail.blur = std::max(detail.blur, kStrayBlur);
    return binned(stray_, pictures_.size(), detail);
  }
  Vector without_stray(const std::vector<double>& reference, Detail detail) const {
    Vector all = binned(reference, pictures_.size(), detail);
    if (!stray_.empty()) all -= stray(detail);
    return all;
  }

  std::vector<const Site*> last(std::size_t count, double farthest) const {
    std::vector<const Site*> chosen;
    const Vector here_now = here();
    for (std::size_t i = sites_.size(); i-- > 0 && chosen.size() < count;)
      if ((layout_.pose(x_, sites_[i].commanded) - here_now).cwiseAbs().maxCoeff() <= farthest)
        chosen.push_back(&sites_[i]);
    return chosen;
  }

  double fit(Derivatives& derivatives, std::size_t sites, double farthest, int steps, double damping) {
    JointFit joint(*known_, layout_, derivatives, pictures_.size(), stray(derivatives.detail()), last(sites, farthest),
                   x_);
    const double cost = joint.solve(x_, steps, damping);
    misfit_ = joint.misfit(0, x_);
    return cost;
  }

  // Coarse fit with blurred images: from the last estimate if it still fits, otherwise from the stored far images that
  // resemble the newest capture most.
  void approach() {
    if (sites_.size() > 1) {
      fit(middle_, 3, 2, 6, 1e-3);
      if (misfit_ < kLost) return guess_best();
    }
    const Site& newest = sites_.back();
    const Vector capture = newest.mean(pictures_.size(), known_->coarse);
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < known_->far_pictures.size(); ++i) {
      const Vector& picture = known_->far_pictures[i];
      const Vector variance = known_->variance((picture + capture) / 2, known_->coarse);
      order.emplace_back((picture - capture).cwiseAbs2().cwiseQuotient(variance).sum(), i);
    }
    std::sort(order.begin(), order.end());
    order.resize(std::min<std::size_t>(order.size(), kTries));
    const Vector before = x_;
    Vector best = before;
    double lowest = std::numeric_limits<double>::infinity();
    for (const auto& [difference, i] : order) {
      x_ = Vector::Zero(layout_.size());
      layout_.set_start(x_, known_->far_poses[i] - layout_.distortion(x_) * newest.commanded);
      fit(coarse_, 1, 2, 8, 1e-2);
      const double cost = fit(middle_, 3, 2, 6, 1e-3);
      if (cost < lowest) best = x_, lowest = cost;
    }
    if (sites_.size() > 1) {
      x_ = before;
      if (fit(middle_, 3, 2, 6, 1e-3) < lowest) best = x_;
    }
    x_ = best;
    fit(middle_, 3, 2, 6, 1e-3);
    guess_best();
  }

  void guess_best() {
    state_of_best_ = layout_.state(x_);
    best_ = (known_->nominal + known_->optimum_by_state * state_of_best_).cwiseMax(0).cwiseMin(1);
  }

  bool near() const { return (best_ - here()).cwiseAbs().maxCoeff() <= kNear; }

  void refine() {
    fit(fine_, 4, kBeside, 3, 1e-4);
    settled_ = misfit_ < kSettled;
    if (misfit_ < kLost) find_best();
  }

  // Finds the pose at which the fitted lens's image differs least from the reference, all pixels weighted equally, as
  // in the score.
  void find_best() {
    const Vector state = layout_.state(x_);
    fine_.improve(best_, state);
    best_ = (best_ + known_->optimum_by_state * (state - state_of_best_)).cwiseMax(0).cwiseMin(1);
    state_of_best_ = state;
    // Where spokes and edges do not overlap the gradient is useless: start with blurred images.
    const Vector weight = known_->variance(reference_, fine_.detail()).cwiseSqrt().cwiseInverse();
    if ((fine_.look(best_, state) - reference_).cwiseProduct(weight).norm() > kBesideEachOther)
      descend(middle_, blurred_reference_);
    descend(fine_, reference_);
  }

  // Gauss-Newton from the current best pose, with all expansions around it, whose errors are independent.
  void descend(Derivatives& derivatives, const Vector& reference) {
    const Vector still = Vector::Zero(state_of_best_.size());
    const Eigen::Index n = best_.size();
    Vector difference = reference - derivatives.look(best_, state_of_best_);
    for (int step = 0; step < 3; ++step) {
      Matrix squares = Matrix::Zero(n, n);
      Vector right = Vector::Zero(n);
      for (const Derivatives::Expansion* near : derivatives.within(kAround, best_, state_of_best_)) {
        const auto columns = near->slopes.leftCols(n);
        squares += columns.transpose() * columns;
        right += columns.transpose() * (reference - near->at(joined(best_, state_of_best_)));
      }
      Vector move = detail::solve(squares, right);
      move *= std::min(1.0, 0.1 / std::max(move.cwiseAbs().maxCoeff(), 1e-12));
      const double length = known_->distance(joined(move, still));
      const Vector next = (best_ + move).cwiseMax(0).cwiseMin(1);
      if (length > 3) {  // shorter steps are safe, and their effect is below the numerical noise of images
        const Vector there = reference - derivatives.look(next, state_of_best_);
        if (there.squaredNorm() > difference.squaredNorm()) break;
        difference = there;
      }
      best_ = next;
      if (length <= 3) break;
    }
  }

  // Shares of the travel: distance to the best pose from which on noise-free images are rendered; distance within which
  // captures are fitted together.
  static constexpr double kNear = 0.2, kBeside = 0.1;
  // Misfits: below, the pose is accurate to a fraction of a pixel; above, the estimate has failed.
  static constexpr double kSettled = 1.08, kLost = 1.4;
  // Standard deviations of a capture's noise: about one pixel of shift.
  static constexpr double kBesideEachOther = 60;
  static constexpr double kAround = 12;  // expansions are exact enough to search the best pose
  static constexpr std::size_t kTries = 3;

  std::shared_ptr<const Knowledge> known_;
  Pictures pictures_;
  Layout layout_;
  std::vector<double> stray_;             // pixels; empty: no disturbances are fitted
  Vector reference_, blurred_reference_;  // fine, middle; without stray light
  Derivatives coarse_, middle_, fine_;
  Vector x_;
  std::vector<Site> sites_;
  Vector best_, state_of_best_;
  bool settled_ = false;
  double misfit_ = 0;
};

}  // namespace tolerance_fit
