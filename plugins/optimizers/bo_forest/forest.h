// A forest of regression trees as a surrogate: mean and variance of the merit at a pose.
#pragma once

#include "tree.h"

namespace bo_forest {

struct ForestOptions {
  TreeOptions tree;
  bool bootstrap = true;       // each tree is fitted to a bootstrap sample
  bool total_variance = true;  // within leaves plus between trees (law of total variance); false: between trees only
  std::size_t trees = 100;
};

class Forest {
 public:
  explicit Forest(const ForestOptions& options) : options_(options) {}

  // The same seed gives the same bootstrap streams at every fit, as in scikit-optimize. min_variance: lower limit of
  // the variance of each leaf, or of that between trees if total_variance is false.
  void fit(const Samples& samples, std::uint64_t seed, double min_variance = 0);

  struct Prediction {
    std::vector<double> mean;
    std::vector<double> variance;
  };
  // features: `count` rows of `axes` numbers.
  void predict(const float* features, std::size_t axes, std::size_t count, Prediction& prediction) const;

 private:
  ForestOptions options_;
  double min_variance_ = 0;
  std::vector<Tree> trees_;
};

}  // namespace bo_forest
