#include "history.hpp"

#include <algorithm>
#include <cmath>
#include <relign/random.hpp>

namespace relign::policies {

double signed_log(double x, double fine) { return std::copysign(portable_log(1 + std::fabs(x) / fine), x); }

void History::add(const Pose& commanded, const std::vector<float>& readings) {
  captures_.push_back({commanded, readings});
  if (format_->score < 0) return;
  const auto score = [this](std::size_t capture) {
    return captures_[capture].readings[static_cast<std::size_t>(format_->score)];
  };
  const std::size_t newest = captures_.size() - 1;
  const auto lower = [&score](std::size_t one, std::size_t other) { return score(one) < score(other); };
  ranked_.insert(std::upper_bound(ranked_.begin(), ranked_.end(), newest, lower), newest);
  ranked_.resize(std::min(ranked_.size(), static_cast<std::size_t>(std::max(1, format_->best))));
}

std::vector<float> History::input() const {
  const HistoryFormat& format = *format_;
  std::vector<float> input(format.count(), 0.0F);
  const Pose& now = captures_.back().pose;
  const auto fill = [&](std::size_t slot, const Capture& capture) {
    float* at = input.data() + slot * format.slot();
    *at++ = 1;
    for (std::size_t axis = 0; axis < format.axes; ++axis) {
      const double away = capture.pose[axis] - now[axis];
      *at++ = static_cast<float>(away);
      *at++ = static_cast<float>(signed_log(away, format.fine_move));
    }
    for (std::size_t k = 0; k < format.readings.size(); ++k) {
      const auto value = static_cast<double>(capture.readings[k]);
      *at++ = static_cast<float>((value - format.mean[k]) / format.deviation[k]);
      *at++ = static_cast<float>(signed_log(value, format.fine[k]));
    }
  };
  const auto best = static_cast<std::size_t>(format.best), last = static_cast<std::size_t>(format.last);
  for (std::size_t k = 0; k < std::min(best, ranked_.size()); ++k) fill(k, captures_[ranked_[k]]);
  for (std::size_t k = 0; k < std::min(last, captures_.size()); ++k)
    fill(best + last - 1 - k, captures_[captures_.size() - 1 - k]);
  return input;
}

}  // namespace relign::policies
