// Random streams: published vectors for Philox4x32-10, moments, and independence of seeds.
#include "base/seeds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <relign/random.hpp>
#include <set>

namespace relign {
namespace {

// From the Random123 distribution (kat_vectors, philox4x32 10 rounds).
TEST(Philox, MatchesKnownAnswers) {
  using Block = std::array<std::uint32_t, 4>;
  EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}), (Block{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox4x32({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}),
            (Block{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Block{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(Random, MatchesMomentsOfUniformAndNormal) {
  Random random(42);
  const int n = 200000;
  double sum = 0, squares = 0, normal_sum = 0, normal_squares = 0, normal_fourth = 0;
  for (int i = 0; i < n; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    sum += u;
    squares += u * u;
    const double z = random.normal();
    normal_sum += z;
    normal_squares += z * z;
    normal_fourth += z * z * z * z;
  }
  // Five standard errors.
  EXPECT_NEAR(sum / n, 0.5, 5 * 0.2887 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1.0 / 3, 5 * 0.298 / std::sqrt(n));
  EXPECT_NEAR(normal_sum / n, 0, 5 / std::sqrt(n));
  EXPECT_NEAR(normal_squares / n, 1, 5 * 1.415 / std::sqrt(n));
  EXPECT_NEAR(normal_fourth / n, 3, 5 * 9.8 / std::sqrt(n));
}

TEST(Random, PortableLogMatchesLibraryLog) {
  Random random(3);
  for (int i = 0; i < 100000; ++i) {
    const double x = std::ldexp(random.uniform() + 0x1p-60, static_cast<int>(random.below(80)) - 60);
    ASSERT_NEAR(portable_log(x), std::log(x), 4e-16 * std::max(1.0, std::fabs(std::log(x)))) << x;
  }
}

TEST(Random, BelowIsUniform) {
  Random random(7, 3);
  int counts[6] = {};
  for (int i = 0; i < 60000; ++i) ++counts[random.below(6)];
  double chi2 = 0;
  for (const int count : counts) chi2 += (count - 10000.0) * (count - 10000.0) / 10000.0;
  EXPECT_LT(chi2, 20.5) << "chi-square, 5 degrees of freedom, p = 0.001";
}

TEST(Random, StreamsDiffer) {
  EXPECT_NE(Random(1, 0).bits64(), Random(1, 1).bits64());
  EXPECT_NE(Random(1, 0).bits64(), Random(2, 0).bits64());
  EXPECT_EQ(Random(1, 5).bits64(), Random(1, 5).bits64());
}

TEST(Seeds, DifferForEveryArgument) {
  std::set<std::uint64_t> seeds;
  for (std::uint64_t number = 0; number < 1000; ++number)
    for (const SeedDomain domain :
         {SeedDomain::benchmark, SeedDomain::training, SeedDomain::tuning, SeedDomain::pretraining})
      seeds.insert(instance_seed(1, domain, number));
  EXPECT_EQ(seeds.size(), 4000u) << "training, tuning, source and benchmark instances are disjoint";
  for (std::uint32_t step = 0; step < 100; ++step)
    for (const FrameStream stream :
         {FrameStream::capture, FrameStream::truth_commanded, FrameStream::truth_recommended, FrameStream::own_optimum})
      seeds.insert(frame_seed(1, step, stream));
  for (const char* label : {"a", "b", "ab", ""}) seeds.insert(algorithm_seed(1, label, 0));
  EXPECT_EQ(seeds.size(), 4000u + 400u + 4u);
}

TEST(Seeds, MatchFrozenValues) {
  // Published results depend on these values: they never change within a format.
  EXPECT_EQ(instance_seed(1, SeedDomain::benchmark, 0), instance_seed(1, SeedDomain::benchmark, 0));
  EXPECT_EQ(instance_seed(1, SeedDomain::benchmark, 0), 8483642811779845944u);
  EXPECT_EQ(frame_seed(123, 4, FrameStream::capture), 9203272311244604812u);
  EXPECT_EQ(algorithm_seed(1, "compass", 2), 370487664205533811u);
}

}  // namespace
}  // namespace relign
