// A forest of regression trees as a surrogate: mean and variance of the merit at a pose.
#pragma once

#include "tree.h"

namespace bo_forest {

struct ForestOptions {
  TreeOptions tree;
  bool bootstrap = true;       // each tree learns from as many draws with replacement
  bool total_variance = true;  // leaves' variance and between trees (law of total variance), else between trees alone
  std::size_t trees = 100;
};

class Forest {
 public:
  explicit Forest(const ForestOptions& options) : options_(options) {}

  // The same seed gives the same bootstrap streams at every fit, as in scikit-optimize. A variance below min_variance
  // counts as that much: each leaf's, or that between the trees where it is the only one.
  void fit(const Samples& samples, std::uint64_t seed, double min_variance = 0);

  struct Prediction {
    std::vector<double> mean;
    std::vector<double> variance;
  };
  // Of `count` rows of features.
  void predict(const float* features, std::size_t axes, std::size_t count, Prediction& prediction) const;

 private:
  ForestOptions options_;
  double min_variance_ = 0;
  std::vector<Tree> trees_;
};

}  // namespace bo_forest
