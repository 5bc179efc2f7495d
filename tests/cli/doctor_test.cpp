#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

json finding(const json& findings, const std::string& what) {
  for (const json& one : findings)
    if (one["what"] == what) return one;
  return nullptr;
}

TEST(CliDoctor, PassesOnThisMachine) {
  const Outcome outcome = relign_bench(Workplace(), {"doctor"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  for (const char* what : {"processor", "instructions", "cores", "memory", "cache folder", "plugin folder", "python3"})
    EXPECT_THAT(outcome.out, HasSubstr(what));
  const json findings = json::parse(relign_bench(Workplace(), {"--json", "doctor"}).out);
  EXPECT_THAT(finding(findings, "plugin folder")["found"].get<std::string>(), HasSubstr(" plugins"));
}

TEST(CliDoctor, ChecksTheChosenPython) {
  const auto found = [](const char* python) {
    Options options;
    options.environment = {{"RELIGN_PYTHON", python}};
    return finding(json::parse(relign_bench(Workplace(), {"--json", "doctor"}, options).out), "python3");
  };
  EXPECT_EQ(found("/bin/sh")["found"], "/bin/sh (RELIGN_PYTHON)");
  EXPECT_EQ(found("/none/python3")["state"], "wrong");
}

TEST(CliDoctor, StatesWhyThereIsNoGpu) {
  Options options;
  options.environment = {{"RELIGN_LIBCUDA", "/none/libcuda.so.1"}};
  const json gpu = finding(json::parse(relign_bench(Workplace(), {"--json", "doctor"}, options).out), "gpu");
  EXPECT_EQ(gpu["state"], "note");
  EXPECT_THAT(gpu["found"].get<std::string>(), HasSubstr("no NVIDIA driver: /none/libcuda.so.1: "));
}

TEST(CliDoctor, ReportsProblems) {
  const Workplace place;
  place.write("bad/relign-plugin.json", R"({"id": "bad", "kind": "optimiser", "summary": "x"})");
  Options options;
  options.environment = {{"RELIGN_PLUGIN_PATH", place.path("bad").string() + ":" + place.path("none").string()},
                         {"XDG_CACHE_HOME", "/proc/none"},
                         {"PATH", "/none"}};
  const Outcome outcome = relign_bench(place, {"--json", "doctor"}, options);
  EXPECT_EQ(outcome.exit_code, 2);
  const json findings = json::parse(outcome.out);
  EXPECT_EQ(finding(findings, "cache folder")["state"], "wrong");
  EXPECT_EQ(finding(findings, "plugin")["state"], "wrong");
  EXPECT_THAT(finding(findings, "plugin")["found"].get<std::string>(), HasSubstr("optimiser"));
  EXPECT_EQ(finding(findings, "python3")["state"], "note");
  EXPECT_EQ(finding(findings, "sbatch")["state"], "note");
  EXPECT_THAT(outcome.out, HasSubstr("none' does not exist"));
}

}  // namespace
}  // namespace relign::cli_test
