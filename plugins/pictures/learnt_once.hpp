// What a plugin learns of a scene or level before the first capture, kept for the trials that come after in the same
// process: the first one pays for them, and what comes out is the same as without.
#pragma once

#include <Eigen/Dense>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pictures {

// All that something was learnt from. Kept whole, so that no two are ever taken for one another.
class Origin {
 public:
  Origin& add(std::string_view text) {
    bytes_ += std::to_string(text.size()) + ':';  // "a" and "bc" are not "ab" and "c"
    bytes_ += text;
    return *this;
  }
  Origin& add(double number) { return add_bytes(&number, 1); }
  // Of a scene, too: it does not describe all that its pictures and their noise depend on.
  Origin& add(const std::vector<float>& pixels) { return add_bytes(pixels.data(), pixels.size()); }
  Origin& add(const Eigen::VectorXf& pixels) {
    return add_bytes(pixels.data(), static_cast<std::size_t>(pixels.size()));
  }

  bool operator==(const Origin& other) const { return bytes_ == other.bytes_; }

 private:
  template <class Number>
  Origin& add_bytes(const Number* first, std::size_t count) {
    return add(std::string_view(reinterpret_cast<const char*>(first), count * sizeof(Number)));
  }

  std::string bytes_;
};

template <class Learnt>
class LearntOnce {
 public:
  explicit LearntOnce(std::size_t most) : most_(most) {}

  // `learn` may throw, and then nothing is kept.
  std::shared_ptr<const Learnt> operator()(const Origin& origin, const std::function<Learnt()>& learn) {
    // Held while it learns: trials beside this one most likely wait for the same.
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [known, learnt] : kept_)
      if (known == origin) return learnt;
    kept_.emplace_back(origin, std::make_shared<const Learnt>(learn()));
    if (kept_.size() > most_) kept_.pop_front();
    return kept_.back().second;
  }

 private:
  std::size_t most_;
  std::mutex mutex_;
  std::deque<std::pair<Origin, std::shared_ptr<const Learnt>>> kept_;  // the last learnt at the end
};

}  // namespace pictures
