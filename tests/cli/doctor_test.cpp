#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

json sign(const json& signs, const std::string& what) {
  for (const json& one : signs)
    if (one["what"] == what) return one;
  return nullptr;
}

TEST(CliDoctor, FindsThisMachineWell) {
  const Outcome outcome = relign_bench(Workplace(), {"doctor"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  for (const char* what : {"processor", "instructions", "cores", "memory", "cache folder", "plugin folder", "python3"})
    EXPECT_THAT(outcome.out, HasSubstr(what));
  const json signs = json::parse(relign_bench(Workplace(), {"--json", "doctor"}).out);
  EXPECT_THAT(sign(signs, "plugin folder")["found"].get<std::string>(), HasSubstr(" plugins"));
}

TEST(CliDoctor, SaysWhatIsWrong) {
  const Workplace place;
  place.write("bad/relign-plugin.json", R"({"id": "bad", "kind": "optimiser", "summary": "x"})");
  Options options;
  options.environment = {{"RELIGN_PLUGIN_PATH", place.path("bad").string() + ":" + place.path("none").string()},
                         {"XDG_CACHE_HOME", "/proc/none"},
                         {"PATH", "/none"}};
  const Outcome outcome = relign_bench(place, {"--json", "doctor"}, options);
  EXPECT_EQ(outcome.exit_code, 2);
  const json signs = json::parse(outcome.out);
  EXPECT_EQ(sign(signs, "cache folder")["state"], "wrong");
  EXPECT_EQ(sign(signs, "plugin")["state"], "wrong");
  EXPECT_THAT(sign(signs, "plugin")["found"].get<std::string>(), HasSubstr("optimiser"));
  EXPECT_EQ(sign(signs, "python3")["state"], "note");
  EXPECT_EQ(sign(signs, "sbatch")["state"], "note");
  EXPECT_THAT(outcome.out, HasSubstr("none does not exist"));
}

}  // namespace
}  // namespace relign::cli_test
