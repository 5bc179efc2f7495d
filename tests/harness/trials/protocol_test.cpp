// What algorithms may observe under each protocol, as one table; and the paper's merit by hand.
#include "trials/protocol.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <relign/plugin.h>

#include <cmath>
#include <limits>

namespace relign::trials {
namespace {

using plugin_host::Kind;
using plugin_host::Manifest;
using testing::Each;
using testing::ElementsAre;
using testing::SizeIs;

constexpr std::uint32_t kImages = RELIGN_OBSERVES_IMAGES;
constexpr std::uint32_t kMerit = RELIGN_OBSERVES_MERIT;
constexpr std::uint32_t kStart = RELIGN_OBSERVES_START;
constexpr std::uint32_t kBox = RELIGN_OBSERVES_BOX;
constexpr double kUnlimited = std::numeric_limits<double>::infinity();

struct Row {
  const char* what;
  Protocol protocol;
  Kind kind;
  bool oracle;
  std::vector<std::string> declares;
  std::uint32_t granted;
  bool own_coordinates;  // of the stage: the algorithm gets the start
  double largest_move;
};

class ProtocolTable : public testing::TestWithParam<Row> {};

TEST_P(ProtocolTable, GrantsObservationsOfTheTable) {
  const Row& row = GetParam();
  SCOPED_TRACE(row.what);
  SceneFacts scene;
  scene.axes.resize(2);
  Instance instance;
  instance.perturbations.start = {0.1, 0.9};
  Manifest manifest;
  manifest.kind = row.kind;
  manifest.oracle = row.oracle;
  manifest.observes = row.declares;

  const Rules rules = make_rules(row.protocol, manifest, instance, scene);
  EXPECT_EQ(rules.observes, row.granted);
  EXPECT_EQ(rules.largest_move, row.largest_move);
  EXPECT_EQ(rules.merit, row.protocol == Protocol::paper ? Merit::combined : Merit::rmse);
  EXPECT_EQ(rules.recommend_current, row.kind == Kind::agent);
  EXPECT_THAT(rules.box_lower, SizeIs(2));
  EXPECT_THAT(rules.box_upper, SizeIs(2));
  if (row.own_coordinates) {
    EXPECT_THAT(rules.commanded_start, ElementsAre(0.1, 0.9));
    EXPECT_THAT(rules.box_lower, Each(0.2));
    EXPECT_THAT(rules.box_upper, Each(0.8));
  } else {
    EXPECT_THAT(rules.commanded_start, ElementsAre(0, 0));
    EXPECT_THAT(rules.box_lower, Each(-0.5)) << "the box does not reveal the start";
    EXPECT_THAT(rules.box_upper, Each(0.5));
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, ProtocolTable,
    testing::Values(
        Row{"paper: an optimizer gets the start",
            Protocol::paper,
            Kind::optimizer,
            false,
            {"merit", "start", "box"},
            kMerit | kStart | kBox,
            true,
            kUnlimited},
        Row{"paper: only declared observations",
            Protocol::paper,
            Kind::optimizer,
            false,
            {"merit", "box"},
            kMerit | kBox,
            false,
            kUnlimited},
        Row{"paper: all observations",
            Protocol::paper,
            Kind::optimizer,
            false,
            {"images", "merit", "start", "box", "design", "level"},
            63u,
            true,
            kUnlimited},
        Row{"paper: an agent moves in short steps",
            Protocol::paper,
            Kind::agent,
            false,
            {"images"},
            kImages,
            false,
            0.2},
        Row{"blind: the start is hidden",
            Protocol::blind,
            Kind::optimizer,
            false,
            {"merit", "start", "box"},
            kMerit | kBox,
            false,
            kUnlimited},
        Row{"blind: all but the start",
            Protocol::blind,
            Kind::optimizer,
            false,
            {"images", "merit", "start", "box", "design", "level"},
            63u & ~kStart,
            false,
            kUnlimited},
        Row{"blind: agents move freely", Protocol::blind, Kind::agent, false, {"images"}, kImages, false, kUnlimited},
        Row{"blind: an oracle gets the start",
            Protocol::blind,
            Kind::optimizer,
            true,
            {"start", "box"},
            kStart | kBox,
            true,
            kUnlimited},
        Row{"an oracle need not declare it", Protocol::blind, Kind::optimizer, true, {}, kStart, true, kUnlimited},
        Row{"no observations", Protocol::blind, Kind::agent, false, {}, 0u, false, kUnlimited}));

TEST(CombinedMerit, EqualsNegatedRewardOfThePaper) {
  // Beyond 0.1 from the nominal pose the distance is added; within, only the image counts.
  EXPECT_DOUBLE_EQ(combined_merit(0.04, {0.8, 0.9}, {0.5, 0.5}), 0.54);
  EXPECT_DOUBLE_EQ(combined_merit(0.04, {0.59, 0.5}, {0.5, 0.5}), 0.04);
  EXPECT_DOUBLE_EQ(combined_merit(0.04, {0.5, 0.5, 0.61}, {0.5, 0.5, 0.5}), 0.15);
  EXPECT_EQ(combined_merit(0.04, {0.125}, {0.125}), 0.04);
  const double just_at = std::sqrt(0.1 * 0.1);
  ASSERT_EQ(just_at, 0.1);
  EXPECT_EQ(combined_merit(0.04, {0.1}, {0.0}), 0.04) << "nothing is added at exactly 0.1";
}

TEST(Names, ReadBack) {
  for (const Protocol protocol : {Protocol::paper, Protocol::blind})
    EXPECT_EQ(protocol_from_name(protocol_name(protocol)), protocol);
  for (const Merit merit : {Merit::combined, Merit::rmse}) EXPECT_EQ(merit_from_name(merit_name(merit)), merit);
  EXPECT_EQ(protocol_from_name("Paper"), std::nullopt);
  EXPECT_EQ(merit_from_name(""), std::nullopt);
}

TEST(Rules, StationsHideTheStartUnderBothProtocols) {
  SceneFacts station;
  station.name = "bench";
  station.axes.resize(2);
  station.nominal_pose = {0.5, 0.5};
  station.owns_stage = true;
  station.truth = false;
  Instance instance;
  instance.perturbations.start = {0.5, 0.5};
  Manifest manifest;
  manifest.kind = Kind::optimizer;
  manifest.observes = {"merit", "start", "box"};
  for (const Protocol protocol : {Protocol::paper, Protocol::blind}) {
    const Rules rules = make_rules(protocol, manifest, instance, station);
    EXPECT_EQ(rules.observes, kMerit | kBox);
    EXPECT_EQ(rules.merit, Merit::rmse);
    EXPECT_THAT(rules.commanded_start, ElementsAre(0, 0));
    EXPECT_THAT(rules.box_lower, Each(-0.5));
    EXPECT_THAT(rules.box_upper, Each(0.5));
  }
  manifest.oracle = true;
  EXPECT_THROW(make_rules(Protocol::blind, manifest, instance, station), Error);
}

}  // namespace
}  // namespace relign::trials
