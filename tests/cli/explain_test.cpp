// explain: an entry for every exit code and every end of a trial.
#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "cli/exit_codes.h"
#include "cli/program.h"
#include "records/trial_ends.h"

namespace relign::cli_test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// The values of an enumeration cannot be listed by a program, so this reads the header.
TEST(Explain, HasAnEntryForEveryExitCode) {
  std::ostringstream header;
  header << std::ifstream(RELIGN_SOURCE_DIR "/core/cli/exit_codes.h").rdbuf();
  const std::string text = header.str();
  const std::regex value(R"(  k\w+ = (\d+))");
  std::size_t found = 0;
  for (std::sregex_iterator at(text.begin(), text.end(), value), end; at != end; ++at, ++found) {
    const Outcome outcome = relign_bench(Workplace(), {"explain", (*at)[1].str()});
    EXPECT_EQ(outcome.exit_code, 0);
    EXPECT_THAT(outcome.out, StartsWith((*at)[1].str() + " (exit code): "));
  }
  EXPECT_EQ(found + 1, cli::kExitCodes.size()) << "and 128+N";
}

TEST(Explain, StatesCausesAndNextStepOfEveryFailure) {
  const Outcome outcome = relign_bench(Workplace(), {"explain", "--json"});
  ASSERT_EQ(outcome.exit_code, 0);
  const nlohmann::json all = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(all.size(), cli::kExitCodes.size() + records::kTrialEnds.size());
  for (const nlohmann::json& entry : all) {
    const std::string code = entry["code"];
    EXPECT_NE(entry["meaning"], "") << code;
    EXPECT_THAT(entry["next"].get<std::string>(), testing::Not(HasSubstr("explain END"))) << "a command that works";
    const bool good = code == "0" || code == "budget_spent" || code == "finished";
    EXPECT_EQ(entry["causes"] == "", good) << code;
    EXPECT_EQ(entry["next"] == "", good) << code;
  }
}

TEST(Explain, TakesCodesAsTheyArePrinted) {
  const Outcome crash = relign_bench(Workplace(), {"explain", "crashed(SIGSEGV)"});
  EXPECT_EQ(crash.exit_code, 0);
  EXPECT_THAT(crash.out, StartsWith("crashed(SIGSEGV) (end of a trial): a plugin ended its process"));
  EXPECT_THAT(crash.out, HasSubstr("\nUsual causes:\n  SIGSEGV"));
  const Outcome killed = relign_bench(Workplace(), {"explain", "137"});
  EXPECT_EQ(killed.exit_code, 0);
  EXPECT_THAT(killed.out, StartsWith("137 (exit code): ended by signal 9 (Killed)"));
}

TEST(Explain, RejectsUnknownCode) {
  for (const char* unknown : {"6", "128", "193", "256", "999", "7(x", "(", "  "})
    EXPECT_EQ(relign_bench(Workplace(), {"explain", unknown}).exit_code, 2) << unknown;
  const Outcome outcome = relign_bench(Workplace(), {"explain", "overspend"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("unknown code 'overspend'; did you mean 'overspent'?\nallowed: 0, 1, 2"));
  EXPECT_THAT(relign_bench(Workplace(), {"explain", "193"}).err, HasSubstr("unknown code '193'\nallowed: 0, 1, 2"));
  EXPECT_THAT(relign_bench(Workplace(), {"explain", "nope"}).err, HasSubstr("unknown code 'nope'\nallowed: 0, 1, 2"));
}

}  // namespace
}  // namespace relign::cli_test
