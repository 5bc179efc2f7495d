// A cache, shared by the trials of a process, of data that a plugin derives from a scene or noise level before the
// first capture. Results do not depend on whether an entry was cached.
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

namespace least_squares {

// The key: everything an entry was derived from. Stored in full instead of hashed, so keys cannot collide.
class Origin {
 public:
  Origin& add(std::string_view text) {
    bytes_ += std::to_string(text.size()) + ':';  // distinguishes "a", "bc" from "ab", "c"
    bytes_ += text;
    return *this;
  }
  Origin& add(double number) { return add_bytes(&number, 1); }
  // Add captures of a scene, too: its description does not contain everything that images and noise depend on.
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

  // Returns the entry of `origin`, from `learn` if there is none yet. If `learn` throws, nothing is cached.
  std::shared_ptr<const Learnt> operator()(const Origin& origin, const std::function<Learnt()>& learn) {
    // Locked during `learn`: concurrent trials most likely need the same entry.
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
  std::deque<std::pair<Origin, std::shared_ptr<const Learnt>>> kept_;  // oldest first
};

}  // namespace least_squares
