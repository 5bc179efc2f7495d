#include "forest.h"

#include <algorithm>
#include <cmath>

namespace bo_forest {

void Forest::fit(const Samples& samples, std::uint64_t seed, double min_variance) {
  min_variance_ = min_variance;
  trees_.resize(options_.trees);
  std::vector<unsigned> copies(samples.size(), 1);
  for (std::size_t tree = 0; tree < trees_.size(); ++tree) {
    relign::Random random(seed, tree);
    if (options_.bootstrap) {
      std::fill(copies.begin(), copies.end(), 0u);
      for (std::size_t draw = 0; draw < samples.size(); ++draw) ++copies[random.below(samples.size())];
    }
    trees_[tree].grow(samples, copies, options_.tree, random);
  }
}

void Forest::predict(const float* features, std::size_t axes, std::size_t count, Prediction& prediction) const {
  std::vector<double>& means = prediction.mean;
  std::vector<double>& squares = prediction.variance;
  means.assign(count, 0);
  squares.assign(count, 0);
  const bool total = options_.total_variance;
  constexpr std::size_t kBlock = 512;  // rows whose features and sums fit into the cache
  std::uint32_t leaf_of[kBlock];
  for (std::size_t first = 0; first < count; first += kBlock) {
    const std::size_t rows = std::min(kBlock, count - first);
    for (const Tree& tree : trees_) {
      tree.find(features + first * axes, axes, rows, leaf_of);
      for (std::size_t i = 0; i < rows; ++i) {
        const Tree::Leaf& leaf = tree.at(leaf_of[i]);
        means[first + i] += leaf.mean;
        squares[first + i] += leaf.mean * leaf.mean + (total ? std::max(leaf.variance, min_variance_) : 0);
      }
    }
  }
  const auto trees = static_cast<double>(trees_.size());
  for (std::size_t i = 0; i < count; ++i) {
    means[i] /= trees;
    squares[i] = std::max(total ? 0.0 : min_variance_, squares[i] / trees - means[i] * means[i]);
  }
}

}  // namespace bo_forest
