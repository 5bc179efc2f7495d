#include "forest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

namespace bo_forest {
namespace {

using nlohmann::json;

json golden_cases() {
  std::ifstream file(RELIGN_TEST_DATA "/forest_trees.json");
  return json::parse(file).at("cases");
}

std::vector<float> flatten(const json& rows) {
  std::vector<float> values;
  for (const json& row : rows)
    for (const json& value : row) values.push_back(value.get<float>());
  return values;
}

Samples samples_of(const json& golden) {
  Samples samples;
  samples.axes = golden.at("features").at(0).size();
  samples.features = flatten(golden.at("features"));
  samples.targets = golden.at("targets").get<std::vector<double>>();
  return samples;
}

Samples random_samples(std::size_t count, std::size_t axes, std::uint64_t seed) {
  relign::Random random(seed);
  Samples samples;
  samples.axes = axes;
  for (std::size_t i = 0; i < count * axes; ++i) samples.features.push_back(static_cast<float>(random.uniform()));
  for (std::size_t i = 0; i < count; ++i) samples.targets.push_back(random.normal());
  return samples;
}

TEST(Tree, MatchesScikitLearn) {
  const json cases = golden_cases();
  ASSERT_EQ(cases.size(), 4u);
  for (const json& golden : cases) {
    SCOPED_TRACE(golden.at("name").get<std::string>());
    const Samples samples = samples_of(golden);
    TreeOptions options;
    options.smallest_leaf = golden.at("smallest_leaf");
    relign::Random random(0);
    Tree tree;
    tree.grow(samples, golden.at("copies").get<std::vector<unsigned>>(), options, random);
    EXPECT_EQ(tree.size(), golden.at("nodes").get<std::size_t>());
    const std::vector<float> queries = flatten(golden.at("queries"));
    std::vector<std::uint32_t> found(golden.at("means").size());
    ASSERT_EQ(found.size(), 200u);
    tree.find(queries.data(), samples.axes, found.size(), found.data());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(tree.at(found[i]).mean, golden.at("means")[i].get<double>(), 1e-6);
      EXPECT_NEAR(tree.at(found[i]).variance, golden.at("variances")[i].get<double>(), 1e-6);
      EXPECT_EQ(&tree.leaf(queries.data() + i * samples.axes), &tree.at(found[i]));
    }
  }
}

// For any thresholds mean and variance of a leaf are those of the samples that the search assigns to it.
TEST(Tree, WithRandomThresholdsAssignsSamplesToTheirLeaves) {
  const Samples samples = random_samples(60, 4, 7);
  TreeOptions options;
  options.random_splits = true;
  relign::Random random(3);
  Tree tree;
  tree.grow(samples, std::vector<unsigned>(samples.size(), 1), options, random);
  EXPECT_GT(tree.size(), 10u);
  std::vector<std::uint32_t> leaf_of(samples.size());
  tree.find(samples.features.data(), samples.axes, samples.size(), leaf_of.data());
  for (const std::uint32_t leaf : leaf_of) {
    double count = 0, sum = 0, squares = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (leaf_of[i] != leaf) continue;
      ++count;
      sum += samples.targets[i];
      squares += samples.targets[i] * samples.targets[i];
    }
    EXPECT_GE(count, 3);
    EXPECT_NEAR(tree.at(leaf).mean, sum / count, 1e-12);
    EXPECT_NEAR(tree.at(leaf).variance, squares / count - sum / count * (sum / count), 1e-12);
  }
  Tree other;  // grown with the next numbers of the stream
  other.grow(samples, std::vector<unsigned>(samples.size(), 1), options, random);
  std::vector<std::uint32_t> other_leaf_of(samples.size());
  other.find(samples.features.data(), samples.axes, samples.size(), other_leaf_of.data());
  EXPECT_NE(leaf_of, other_leaf_of);
}

TEST(Tree, WithEqualFeaturesOrTargetsIsOneLeaf) {
  for (const bool random_splits : {false, true}) {
    TreeOptions options;
    options.random_splits = random_splits;
    relign::Random random(3);
    Samples same_place = random_samples(20, 3, 1);
    same_place.features.assign(same_place.features.size(), 0.25f);
    Samples flat = random_samples(20, 3, 1);
    flat.targets.assign(flat.size(), 5);
    for (const Samples& samples : {same_place, flat}) {
      Tree tree;
      tree.grow(samples, std::vector<unsigned>(20, 1), options, random);
      EXPECT_EQ(tree.size(), 1u);
    }
  }
}

// Two axes that split the samples in the same way are used equally often, as in scikit-learn, which visits axes in
// random order. Where they contradict each other, the forest's mean is in the middle.
TEST(Forest, BreaksTiesBetweenAxesAtRandom) {
  Samples samples;
  samples.axes = 2;
  for (int i = 0; i < 12; ++i) {
    samples.features.insert(samples.features.end(), 2, static_cast<float>(i));  // both axes equal
    samples.targets.push_back(i < 6 ? 0 : 1);
  }
  const float contradictory[] = {0, 11, 11, 0};
  ForestOptions options;
  options.bootstrap = false;
  options.trees = 1000;
  for (const bool random_splits : {false, true}) {
    options.tree.random_splits = random_splits;
    Forest forest(options);
    forest.fit(samples, 1);
    Forest::Prediction prediction;
    forest.predict(contradictory, 2, 2, prediction);
    // The standard error of a share of one half among 1,000 trees is 0.016.
    for (const double mean : prediction.mean) EXPECT_NEAR(mean, 0.5, 0.06) << (random_splits ? "random" : "best");
  }
}

TEST(Forest, WithEqualTreesHasVarianceOfTheirLeaves) {
  const json golden = golden_cases().at(0);
  const Samples samples = samples_of(golden);
  const std::vector<float> queries = flatten(golden.at("queries"));
  for (const bool total : {true, false}) {
    ForestOptions options;
    options.bootstrap = false;
    options.total_variance = total;
    Forest forest(options);
    for (const double least : {0.0, 0.004}) {
      forest.fit(samples, 1, least);
      Forest::Prediction prediction;
      forest.predict(queries.data(), samples.axes, 200, prediction);
      for (std::size_t i = 0; i < 200; ++i) {
        EXPECT_NEAR(prediction.mean[i], golden.at("means")[i].get<double>(), 1e-6);
        EXPECT_NEAR(prediction.variance[i], std::max(least, total ? golden.at("variances")[i].get<double>() : 0), 1e-6);
      }
    }
  }
}

// Total variance computed differently: the variance of draws from the leaves of all trees.
TEST(Forest, VarianceFollowsTheLawOfTotalVariance) {
  const Samples samples = random_samples(40, 3, 11);
  ForestOptions options;
  options.trees = 25;
  std::vector<Tree> trees(options.trees);
  for (std::size_t tree = 0; tree < options.trees; ++tree) {  // the same draws as in forest.cpp
    relign::Random random(9, tree);
    std::vector<unsigned> copies(samples.size(), 0);
    for (std::size_t draw = 0; draw < samples.size(); ++draw) ++copies[random.below(samples.size())];
    trees[tree].grow(samples, copies, options.tree, random);
  }
  const Samples queries = random_samples(1000, 3, 12);
  for (const bool total : {true, false}) {
    options.total_variance = total;
    Forest forest(options);
    forest.fit(samples, 9);
    Forest::Prediction prediction;
    forest.predict(queries.features.data(), 3, 1000, prediction);
    for (std::size_t i = 0; i < 1000; i += 37) {
      double mean = 0, within = 0, between = 0;
      for (const Tree& tree : trees) {
        mean += tree.leaf(queries.row(i)).mean / 25;
        within += tree.leaf(queries.row(i)).variance / 25;
      }
      for (const Tree& tree : trees) between += std::pow(tree.leaf(queries.row(i)).mean - mean, 2) / 25;
      EXPECT_NEAR(prediction.mean[i], mean, 1e-12);
      EXPECT_NEAR(prediction.variance[i], between + (total ? within : 0), 1e-12);
    }
  }
}

}  // namespace
}  // namespace bo_forest
