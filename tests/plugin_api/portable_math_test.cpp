// relign/portable_math.hpp against the C library in long double, which is closer to the truth than both.
#include <gtest/gtest.h>

#include <cmath>
#include <relign/portable_math.hpp>
#include <relign/random.hpp>

namespace relign {
namespace {

TEST(PortableMath, SineAndCosineOfDegrees) {
  for (double degrees = -360; degrees <= 360; degrees += 0.37) {
    const SineCosine ours = portable_sine_cosine(degrees);
    const long double x = static_cast<long double>(degrees) * 3.14159265358979323846264338327950288L / 180;
    EXPECT_NEAR(ours.sine, static_cast<double>(std::sin(x)), 4e-16) << degrees;
    EXPECT_NEAR(ours.cosine, static_cast<double>(std::cos(x)), 4e-16) << degrees;
  }
  EXPECT_EQ(portable_sine_cosine(90).sine, 1);
  EXPECT_EQ(portable_sine_cosine(90).cosine, 0);
  EXPECT_EQ(portable_sine_cosine(0).cosine, 1);
}

TEST(PortableMath, Exponential) {
  Random random(11);
  for (int i = 0; i < 200000; ++i) {
    const double x = random.uniform(-700, 700) * (i % 2 ? 1 : 0.002);
    const long double truth = std::exp(static_cast<long double>(x));
    ASSERT_NEAR(static_cast<double>(portable_exp(x) / truth), 1.0, 7e-16) << x;
  }
  EXPECT_EQ(portable_exp(0), 1);
  EXPECT_EQ(portable_exp(-701), 0);
  EXPECT_EQ(portable_exp(701), HUGE_VAL);
  EXPECT_TRUE(std::isnan(portable_exp(std::nan(""))));
}

// Bits that every machine gives: a change of these is a change of every image and draw made with them.
TEST(PortableMath, BitsAreFrozen) {
  EXPECT_EQ(portable_exp(1), 0x1.5bf0a8b14576ap+1);
  EXPECT_EQ(portable_exp(-2.5), 0x1.50385c094f425p-4);
  EXPECT_EQ(portable_sine_cosine(30).sine, 0x1.fffffffffffffp-2);
  EXPECT_EQ(portable_sine_cosine(200).cosine, -0x1.e11f642522d1cp-1);
}

}  // namespace
}  // namespace relign
