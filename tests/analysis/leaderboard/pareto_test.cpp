#include "leaderboard/pareto.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relign::leaderboard {
namespace {

using statistics::kMissing;
using testing::ElementsAre;
using testing::HasSubstr;

CostPoint point(const std::string& name, double cost, double error) { return {name, cost, {10, error, {}}}; }

TEST(ParetoFront, HasWhatNoOtherBeatsInBoth) {
  EXPECT_THAT(pareto_front({point("dear", 9, 0.1), point("cheap", 1, 0.9), point("beaten", 5, 0.6),
                            point("between", 4, 0.5), point("same cost", 4, 0.7)}),
              ElementsAre(1, 3, 0));
}

TEST(ParetoFront, KeepsTheFirstOfEqualPoints) {
  EXPECT_THAT(pareto_front({point("a", 1, 0.5), point("b", 1, 0.5), point("c", 2, 0.5)}), ElementsAre(0));
}

TEST(ParetoFront, LeavesOutUnknownCostsAndErrors) {
  EXPECT_THAT(pareto_front({point("no cost", kMissing, 0.1), point("no error", 1, kMissing), point("known", 3, 0.4)}),
              ElementsAre(2));
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(CostFigure, NamesTheFrontInItsCaption) {
  const auto figure =
      cost_figure({"Error against time", "time", "s", true, {point("fast", 1, 0.5), point("slow", 100, 0.1)}});
  ASSERT_TRUE(figure);
  EXPECT_THAT(figure->caption, HasSubstr("fast (1.00 s, error 0.500); slow (100 s, error 0.100)"));
  EXPECT_TRUE(figure->chart.x.logarithmic);
  ASSERT_EQ(figure->chart.series.size(), 3u) << "two methods and the front";
  EXPECT_EQ(figure->chart.series[2].points[1].x, 100);
}

// A method without training costs nothing, which a logarithmic axis cannot show.
TEST(CostFigure, IsLinearWithACostOfZero) {
  const auto figure = cost_figure({"t", "training", "h", true, {point("free", 0, 0.5), point("dear", 10, 0.1)}});
  ASSERT_TRUE(figure);
  EXPECT_FALSE(figure->chart.x.logarithmic);
  EXPECT_EQ(figure->chart.x.low, 0);
}

TEST(CostFigure, IsLeftOutWithFewerThanTwoPoints) {
  EXPECT_FALSE(cost_figure({"t", "time", "s", true, {point("a", 1, 0.5), point("b", kMissing, 0.1)}}));
}

}  // namespace
}  // namespace relign::leaderboard
