#include "tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace bo_forest {

// scikit-learn's constants: features closer than this are equal; nodes of smaller variance are not split.
constexpr float kSameFeature = 1e-7f;
constexpr double kNoVariance = std::numeric_limits<double>::epsilon();

class TreeBuilder {
 public:
  TreeBuilder(Tree& tree, const Samples& samples, const std::vector<unsigned>& copies, const TreeOptions& options,
              relign::Random& random)
      : tree_(tree), samples_(samples), copies_(copies), options_(options), random_(random) {}

  void build() {
    for (std::uint32_t sample = 0; sample < samples_.size(); ++sample)
      if (copies_[sample] > 0) members_.push_back(sample);
    sorted_.reserve(members_.size());
    axes_.resize(samples_.axes);
    std::iota(axes_.begin(), axes_.end(), 0u);
    add_node();
    std::vector<Part> open{{0, 0, members_.size(), 0}};
    while (!open.empty()) {
      const Part part = open.back();
      open.pop_back();
      tree_.depth_ = std::max(tree_.depth_, part.depth);
      Split split;
      if (!describe(part) || !(split = find_split(part)).found) continue;
      const std::size_t middle = divide(part, split);
      const std::uint32_t child = add_node();
      add_node();
      tree_.nodes_[part.node] = {split.threshold, split.axis, child};
      open.push_back({child, part.begin, middle, part.depth + 1});
      open.push_back({child + 1, middle, part.end, part.depth + 1});
    }
  }

 private:
  struct Part {  // members_[begin, end) belong to the node
    std::uint32_t node;
    std::size_t begin;
    std::size_t end;
    unsigned depth;
  };
  struct Sums {
    double weight = 0;
    double sum = 0;
    void add(double copies, double target) {
      weight += copies;
      sum += copies * target;
    }
    double gain() const { return sum * sum / weight; }
  };
  struct Split {
    bool found = false;
    double gain = -std::numeric_limits<double>::infinity();
    float threshold = 0;
    std::uint32_t axis = 0;
  };

  std::uint32_t add_node() {
    const auto node = static_cast<std::uint32_t>(tree_.nodes_.size());
    tree_.nodes_.push_back({std::numeric_limits<float>::infinity(), 0, node});
    tree_.leaves_.emplace_back();
    return node;
  }

  float feature(std::uint32_t sample, std::uint32_t axis) const { return samples_.row(sample)[axis]; }

  // Computes mean and variance of a node. Returns false if it stays a leaf.
  bool describe(const Part& part) {
    Sums all;
    for (std::size_t i = part.begin; i < part.end; ++i) all.add(copies_[members_[i]], samples_.targets[members_[i]]);
    const double mean = all.sum / all.weight;
    double squares = 0;
    for (std::size_t i = part.begin; i < part.end; ++i) {
      const double away = samples_.targets[members_[i]] - mean;
      squares += copies_[members_[i]] * away * away;
    }
    tree_.leaves_[part.node] = {mean, squares / all.weight};
    node_ = all;
    return part.end - part.begin >= 2 * options_.smallest_leaf && squares / all.weight > kNoVariance;
  }

  // Axes are tried in random order, as in scikit-learn: with few samples two axes often split a node in the same way,
  // and the first one wins. A fixed order would select the same axis throughout the forest.
  Split find_split(const Part& part) {
    Split best;
    for (std::size_t left = axes_.size(); left > 0; --left) {
      std::swap(axes_[random_.below(left)], axes_[left - 1]);
      const std::uint32_t axis = axes_[left - 1];
      if (options_.random_splits)
        try_one_threshold(part, axis, best);
      else
        try_all_thresholds(part, axis, best);
    }
    return best;
  }

  // The largest float not above the double, so that x > threshold is unchanged for floats x.
  static float round_down(double threshold) {
    const auto rounded = static_cast<float>(threshold);
    return rounded > threshold ? std::nextafter(rounded, -std::numeric_limits<float>::infinity()) : rounded;
  }

  void try_all_thresholds(const Part& part, std::uint32_t axis, Split& best) {
    sorted_.clear();
    for (std::size_t i = part.begin; i < part.end; ++i) sorted_.emplace_back(feature(members_[i], axis), members_[i]);
    std::sort(sorted_.begin(), sorted_.end());
    if (sorted_.back().first <= sorted_.front().first + kSameFeature) return;
    Sums left;
    for (std::size_t i = 1; i < sorted_.size(); ++i) {  // i samples on the left
      const std::uint32_t sample = sorted_[i - 1].second;
      left.add(copies_[sample], samples_.targets[sample]);
      if (i < options_.smallest_leaf || sorted_.size() - i < options_.smallest_leaf) continue;
      const float before = sorted_[i - 1].first;
      const float after = sorted_[i].first;
      if (after <= before + kSameFeature) continue;
      keep_if_better(left, axis, round_down(0.5 * before + 0.5 * after), best);
    }
  }

  void try_one_threshold(const Part& part, std::uint32_t axis, Split& best) {
    float lowest = feature(members_[part.begin], axis);
    float highest = lowest;
    for (std::size_t i = part.begin + 1; i < part.end; ++i) {
      lowest = std::min(lowest, feature(members_[i], axis));
      highest = std::max(highest, feature(members_[i], axis));
    }
    if (highest <= lowest + kSameFeature) return;
    float threshold = round_down(random_.uniform(lowest, highest));
    if (threshold >= highest) threshold = lowest;
    Sums left;
    std::size_t count = 0;
    for (std::size_t i = part.begin; i < part.end; ++i) {
      const std::uint32_t sample = members_[i];
      if (feature(sample, axis) > threshold) continue;
      left.add(copies_[sample], samples_.targets[sample]);
      ++count;
    }
    if (count < options_.smallest_leaf || part.end - part.begin - count < options_.smallest_leaf) return;
    keep_if_better(left, axis, threshold, best);
  }

  // The squared error of both parts is smallest where the sum of their gains is greatest.
  void keep_if_better(const Sums& left, std::uint32_t axis, float threshold, Split& best) const {
    const Sums right{node_.weight - left.weight, node_.sum - left.sum};
    const double gain = left.gain() + right.gain();
    if (gain > best.gain) best = {true, gain, threshold, axis};
  }

  std::size_t divide(const Part& part, const Split& split) {
    const auto begin = members_.begin() + static_cast<std::ptrdiff_t>(part.begin);
    const auto end = members_.begin() + static_cast<std::ptrdiff_t>(part.end);
    // Stable, so that the order of sums, and thus their last bits, do not depend on the standard library.
    const auto middle = std::stable_partition(
        begin, end, [&](std::uint32_t sample) { return !(feature(sample, split.axis) > split.threshold); });
    return static_cast<std::size_t>(middle - members_.begin());
  }

  Tree& tree_;
  const Samples& samples_;
  const std::vector<unsigned>& copies_;
  const TreeOptions& options_;
  relign::Random& random_;
  std::vector<std::uint32_t> members_;
  std::vector<std::uint32_t> axes_;                      // in the order of the previous node
  std::vector<std::pair<float, std::uint32_t>> sorted_;  // scratch
  Sums node_;                                            // of the current node
};

void Tree::grow(const Samples& samples, const std::vector<unsigned>& copies, const TreeOptions& options,
                relign::Random& random) {
  nodes_.clear();
  leaves_.clear();
  depth_ = 0;
  TreeBuilder(*this, samples, copies, options, random).build();
}

void Tree::find(const float* features, std::size_t axes, std::size_t count, std::uint32_t* leaf_of) const {
  constexpr std::size_t kTogether = 8;  // interleaved searches hide memory latency
  std::size_t first = 0;
  for (; first + kTogether <= count; first += kTogether) {
    std::uint32_t node[kTogether] = {};
    const float* row = features + first * axes;
    for (unsigned level = 0; level < depth_; ++level)
      for (std::size_t i = 0; i < kTogether; ++i) node[i] = next(node[i], row + i * axes);
    std::copy(node, node + kTogether, leaf_of + first);
  }
  for (; first < count; ++first) leaf_of[first] = find(features + first * axes);
}

}  // namespace bo_forest
