// Completions in bash, and in zsh and fish where they are installed, from the shells' own completion functions.
#include <gmock/gmock.h>

#include <sstream>

#include "cli/program.h"

namespace relign::cli_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::Not;
using testing::UnorderedElementsAre;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string quoted(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += " '" + word + "'";
  return text;
}

// Bash's completions of the last of these words, which are split as by readline.
std::vector<std::string> bash_completions(const Workplace& place, const std::vector<std::string>& words) {
  place.write("complete.bash",
              "set -u\neval \"$(\"$RELIGN_BENCH\" completion bash)\"\n"
              "COMP_WORDS=(\"$RELIGN_BENCH\"" +
                  quoted(words) + ")\nCOMP_CWORD=" + std::to_string(words.size()) +
                  "\n"
                  "_relign_bench\nprintf '%s\\n' ${COMPREPLY[@]+\"${COMPREPLY[@]}\"}\n");
  const Outcome outcome = shell(place, "exec bash complete.bash");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  const std::vector<std::string> lines = lines_of(outcome.out);
  return lines == std::vector<std::string>{""} ? std::vector<std::string>{} : lines;
}

bool installed(const std::string& program) {
  return shell(Workplace(), "command -v " + program + " >/dev/null").exit_code == 0;
}

TEST(Completion, BashLoadsTheScript) {
  const Workplace place;
  const Outcome script = relign_bench(place, {"completion", "bash"});
  ASSERT_EQ(script.exit_code, 0);
  place.write("script.bash", script.out);
  const Outcome read = shell(place, "bash -n script.bash && bash -c '. ./script.bash; complete -p relign-bench'");
  EXPECT_EQ(read.exit_code, 0) << read.err;
  EXPECT_EQ(read.out, "complete -F _relign_bench relign-bench\n");
}

TEST(Completion, CompletesVerbs) {
  const Workplace place;
  EXPECT_THAT(bash_completions(place, {""}), IsSupersetOf({"run", "try", "list", "lens", "completion"}));
  EXPECT_THAT(bash_completions(place, {""}), Not(Contains("worker"))) << "a hidden verb";
  EXPECT_THAT(bash_completions(place, {"re"}), UnorderedElementsAre("render", "report"));
  EXPECT_THAT(bash_completions(place, {"lens", "tr"}), ElementsAre("trace"));
  EXPECT_THAT(bash_completions(place, {"--json", "lens", "tr"}), ElementsAre("trace"));
  EXPECT_THAT(bash_completions(place, {"no-such-verb", "re"}), IsEmpty());
}

TEST(Completion, CompletesOptionsOfTheVerbAndOfTheProgram) {
  const Workplace place;
  EXPECT_THAT(bash_completions(place, {"run", "--w"}), ElementsAre("--workers"));
  EXPECT_THAT(bash_completions(place, {"run", "-"}), IsSupersetOf({"--workers", "--out", "--progress", "--help"}));
  EXPECT_THAT(bash_completions(place, {"list", "-"}), Not(Contains("--workers")));
  EXPECT_THAT(bash_completions(place, {"plugin", "check", "--one"}), IsEmpty()) << "a hidden option";
  EXPECT_THAT(bash_completions(place, {"run", "--", "--w"}), IsEmpty());
}

TEST(Completion, CompletesIds) {
  const Workplace place;
  EXPECT_THAT(bash_completions(place, {"try", "nlopt-sb"}), ElementsAre("nlopt-sbplx")) << "a preset";
  EXPECT_THAT(bash_completions(place, {"try", ""}), Not(Contains("relign_od")));
  EXPECT_THAT(bash_completions(place, {"try", "random", "--noise-level", ""}),
              IsSupersetOf({"rho0", "rho0.25", "rho0.5"}));
  EXPECT_THAT(bash_completions(place, {"try", "random", "--scene", "relign_o"}), Contains("relign_od"));
  EXPECT_THAT(bash_completions(place, {"describe", "r"}), IsSupersetOf({"random", "relign_od", "rho0"}));
  EXPECT_THAT(bash_completions(place, {"try", "random", "rho"}), IsEmpty()) << "try takes one argument";
}

TEST(Completion, CompletesValuesOfOptions) {
  const Workplace place;
  EXPECT_THAT(bash_completions(place, {"try", "random", "--protocol", ""}), UnorderedElementsAre("paper", "blind"));
  EXPECT_THAT(bash_completions(place, {"try", "random", "--protocol", "=", "b"}), ElementsAre("blind"));
  EXPECT_THAT(bash_completions(place, {"try", "random", "--protocol", "="}), UnorderedElementsAre("paper", "blind"));
  const Outcome whole = relign_bench(place, {"complete", "--", "try", "--protocol=b"});  // as zsh and fish call it
  EXPECT_EQ(whole.out, "--protocol=blind\n");
  EXPECT_THAT(bash_completions(place, {"completion", ""}), UnorderedElementsAre("bash", "zsh", "fish"));
  EXPECT_THAT(bash_completions(place, {"list", "no"}), ElementsAre("noise-levels"));
  EXPECT_THAT(bash_completions(place, {"plugin", "new", "--kind", "o"}), ElementsAre("optimizer"));
  EXPECT_THAT(bash_completions(place, {"run", "--workers", ""}), IsEmpty()) << "a number";
}

TEST(Completion, CompletesFilesAndFolders) {
  const Workplace place;
  place.write("my suites/one suite.json", "{}");
  place.write("my suites/inside/x", "");
  EXPECT_THAT(bash_completions(place, {"run", "my"}), ElementsAre("my suites"));
  EXPECT_THAT(bash_completions(place, {"run", "my suites/"}),
              UnorderedElementsAre("my suites/one suite.json", "my suites/inside"));
  EXPECT_THAT(bash_completions(place, {"report", "my suites/"}), ElementsAre("my suites/inside"));
  EXPECT_THAT(bash_completions(place, {"try", "./my"}), ElementsAre("./my suites"))
      << "paths are allowed wherever ids are";
}

TEST(Completion, UsesPluginsOfTheCommandLine) {
  const Workplace place;
  EXPECT_THAT(bash_completions(place, {"--plugin", RELIGN_BREAKS_DOWN, "try", "breaks"}), ElementsAre("breaks_down"));
  EXPECT_THAT(bash_completions(place, {"try", "breaks"}), IsEmpty());
  EXPECT_THAT(bash_completions(place, {"--plugin", "nowhere", "try", "nlopt-sb"}), IsEmpty()) << "and no message";
}

TEST(Completion, ZshLoadsTheScriptAndCompletesIds) {
  if (!installed("zsh")) GTEST_SKIP() << "zsh is not installed";
  const Workplace place;
  const Outcome outcome = shell(place, R"("$RELIGN_BENCH" completion zsh > _relign-bench && zsh -n _relign-bench &&
zsh -f -c '
fpath=($PWD $fpath); autoload -Uz compinit; compinit -u -d $PWD/dump
compset() { : }
_describe() { print -l -- "${(@P)2}" }
words=("$RELIGN_BENCH" try nlopt-sb); CURRENT=3
_relign-bench')");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, testing::StartsWith("nlopt-sbplx:")) << outcome.err;
}

TEST(Completion, FishCompletesVerbsAndIds) {
  if (!installed("fish")) GTEST_SKIP() << "fish is not installed";
  const Workplace place;
  const Outcome outcome = shell(place, R"(ln -s "$RELIGN_BENCH" relign-bench; export HOME="$PWD" PATH="$PWD:$PATH"
relign-bench completion fish > script.fish && fish --no-execute script.fish &&
fish -c 'source script.fish; complete -C "relign-bench re"; complete -C "relign-bench try nlopt-sb"')");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, testing::HasSubstr("render\tRender one image")) << outcome.err;
  EXPECT_THAT(outcome.out, testing::HasSubstr("nlopt-sbplx\t"));
}

TEST(Completion, RejectsUnknownShell) {
  const Outcome outcome = relign_bench(Workplace(), {"completion", "bahs"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, testing::HasSubstr("unknown shell 'bahs'; did you mean 'bash'?"));
}

}  // namespace
}  // namespace relign::cli_test
