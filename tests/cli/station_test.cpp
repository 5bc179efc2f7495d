// Hardware stations (scenes that own their stage) on the command line.
#include <gmock/gmock.h>

#include "cli/program.h"

namespace relign::cli_test::station {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const char* const kSuite = R"({"scenes": [{"use": "toy-station", "name": "bench", "parameters": {"fails_at_move": 5}}],
  "noise_levels": ["none"], "algorithms": ["nlopt-sbplx"], "instances": 4, "steps": 8})";

TEST(CliStation, ReportShowsMeasuredAndUnknownValues) {
  const Workplace place;
  place.write("bench.json", kSuite);
  const Outcome outcome = relign_bench(place, {"run", "bench.json", "--plugin", RELIGN_TOY_STATION});
  ASSERT_EQ(outcome.exit_code, 3) << outcome.err;  // every second trial fails
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("skipping home"), HasSubstr("lost its reference")));
  EXPECT_THAT(outcome.out, AllOf(HasSubstr("a station has no ground truth"), HasSubstr("measured only"),
                                 HasSubstr("nlopt-sbplx"), Not(HasSubstr("noise-free"))));
  const std::string page = place.read("results/bench/report.html");
  EXPECT_THAT(
      page, AllOf(HasSubstr("lowest median measured error"), HasSubstr("Measured only: a station has no ground truth"),
                  HasSubstr("True poses, noise-free errors"), HasSubstr("cannot be replayed"),
                  HasSubstr("first and last capture")));
  EXPECT_THAT(place.read("results/bench/curves.csv"), HasSubstr(",,,,,,,,,,,,,,"));  // no ground truth, empty columns

  const Outcome again = relign_bench(place, {"run", "bench.json", "--plugin", RELIGN_TOY_STATION});
  EXPECT_THAT(again.err, HasSubstr("8 of them reused"));
}

TEST(CliStation, VerbsHandleStations) {
  const Workplace place;
  place.write("bench.json", kSuite);
  const auto bench = [&place](std::vector<std::string> words) {
    words.insert(words.end(), {"--plugin", RELIGN_TOY_STATION});
    return relign_bench(place, words);
  };
  const Outcome valid = bench({"validate", "bench.json"});
  EXPECT_EQ(valid.exit_code, 0);
  EXPECT_THAT(valid.out, AllOf(HasSubstr("trials         8"), HasSubstr("unknown: set by the hardware station")));

  const Outcome tried = bench({"try", "nlopt-sbplx", "--scene", "toy-station", "--steps", "3"});
  EXPECT_EQ(tried.exit_code, 0);
  EXPECT_THAT(tried.out, HasSubstr("unknown"));
  EXPECT_THAT(tried.err, HasSubstr("measured only"));

  const Outcome level = bench({"try", "random", "--scene", "toy-station", "--noise-level", "rho0"});
  EXPECT_EQ(level.exit_code, 2);
  EXPECT_THAT(level.err, HasSubstr("use none"));
  const Outcome home = bench({"try", "home", "--scene", "toy-station"});
  EXPECT_EQ(home.exit_code, 2);
  EXPECT_THAT(home.err, HasSubstr("requires the true start pose"));
  const Outcome rendered = bench({"render", "--scene", "toy-station", "-o", "a.png"});
  EXPECT_EQ(rendered.exit_code, 2);
  EXPECT_THAT(rendered.err, HasSubstr("is a hardware station"));
}

}  // namespace
}  // namespace relign::cli_test::station
