// A regression tree, grown as in scikit-learn: squared error, all axes at every split, unlimited depth.
#pragma once

#include <cstddef>
#include <cstdint>
#include <relign/plugin.hpp>
#include <vector>

namespace bo_forest {

// Training data. Features are float32, as in scikit-learn.
struct Samples {
  std::size_t axes = 0;
  std::vector<float> features;  // row by row
  std::vector<double> targets;

  std::size_t size() const { return targets.size(); }
  const float* row(std::size_t sample) const { return features.data() + sample * axes; }
};

struct TreeOptions {
  bool random_splits = false;     // one uniform threshold per axis (extra trees); false: the best of all thresholds
  std::size_t smallest_leaf = 3;  // distinct samples, without bootstrap copies
};

class Tree {
 public:
  struct Leaf {
    double mean = 0;
    double variance = 0;  // of its targets: scikit-learn's impurity
  };

  // copies[i]: weight of sample i, 0 to omit it; at least one must be positive.
  void grow(const Samples& samples, const std::vector<unsigned>& copies, const TreeOptions& options,
            relign::Random& random);

  const Leaf& leaf(const float* features) const { return leaves_[find(features)]; }

  // Writes the leaf of each of `count` rows of `axes` features to leaf_of; faster than row by row.
  void find(const float* features, std::size_t axes, std::size_t count, std::uint32_t* leaf_of) const;
  const Leaf& at(std::uint32_t node) const { return leaves_[node]; }

  // Number of nodes, leaves included.
  std::size_t size() const { return nodes_.size(); }

 private:
  // The second child follows the first. A leaf is its own first child with an infinite threshold, so the search can run
  // for a fixed number of levels without branches.
  struct Node {
    float threshold;
    std::uint32_t axis;
    std::uint32_t first_child;
  };
  std::uint32_t next(std::uint32_t node, const float* features) const {
    const Node& at = nodes_[node];
    return at.first_child + static_cast<std::uint32_t>(features[at.axis] > at.threshold);
  }
  std::uint32_t find(const float* features) const {
    std::uint32_t node = 0;
    for (unsigned level = 0; level < depth_; ++level) node = next(node, features);
    return node;
  }

  friend class TreeBuilder;
  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;  // one per node
  unsigned depth_ = 0;
};

}  // namespace bo_forest
