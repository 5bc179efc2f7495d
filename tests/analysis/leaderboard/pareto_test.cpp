#include "leaderboard/pareto.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relign::leaderboard {
namespace {

using statistics::kMissing;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

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

TEST(CostPicture, NamesTheFrontInItsTextAlternative) {
  HtmlWriter html;
  draw_costs(html, {"Error against time", "time", "s", true, {point("fast", 1, 0.5), point("slow", 100, 0.1)}});
  const std::string drawn = html.take();
  EXPECT_THAT(drawn, HasSubstr("role=\"img\" aria-label=\"Error against time."));
  EXPECT_THAT(drawn, HasSubstr("fast (1.00 s, error 0.500); slow (100 s, error 0.100)"));
  EXPECT_THAT(drawn, HasSubstr("<figcaption>Error against time."));
}

// A method without training costs nothing, which a logarithmic axis cannot show.
TEST(CostPicture, IsLinearWithACostOfZero) {
  HtmlWriter html;
  draw_costs(html, {"t", "training", "h", true, {point("free", 0, 0.5), point("dear", 10, 0.1)}});
  const std::string drawn = html.take();
  EXPECT_THAT(drawn, Not(HasSubstr("nan")));
  EXPECT_THAT(drawn, HasSubstr("cx=\"50\"")) << "at the left end";
}

TEST(CostPicture, IsLeftOutWithFewerThanTwoPoints) {
  HtmlWriter html;
  draw_costs(html, {"t", "time", "s", true, {point("a", 1, 0.5), point("b", kMissing, 0.1)}});
  EXPECT_EQ(html.take(), "");
}

}  // namespace
}  // namespace relign::leaderboard
