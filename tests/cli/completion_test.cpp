// Completions: of bash's function alone, and of interactive bash, zsh and fish where they are installed.
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

TEST(Completion, CompletesInstalledSuitesAndFiles) {
  const Workplace place;
  place.write("quiet.json", "{}");
  EXPECT_THAT(bash_completions(place, {"run", "qui"}), UnorderedElementsAre("quick", "quiet.json"));
  EXPECT_THAT(bash_completions(place, {"validate", "optimizers_"}), ElementsAre("optimizers_blind"));
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

// What a Tab makes of a word, in every shell.
struct Case {
  std::string before, typed, completed;  // before: the words between program and cursor; words are not quoted yet
  std::string program = "relign-bench";
};
const std::vector<Case> kCases = {
    {"", "comple", "completion"},
    {"lens", "tr", "trace"},
    {"run", "--wor", "--workers"},
    {"run", "--pla", "--plan"},
    {"explain", "time", "timeout"},
    {"try", "nlopt-sb", "nlopt-sbplx"},
    {"try random --noise-level", "rho0.25-p", "rho0.25-package"},
    {"try random --protocol", "bl", "blind"},
    {"try random", "--protocol=bl", "--protocol=blind"},
    {"run", "pla", "plain.json"},
    {"run", "my suites/o", "my suites/one suite.json"},
    {"run --out", "my", "my suites/"},
    {"run", "--out=my", "--out=my suites/"},
    {"report", "my suites/", "my suites/inside/"},
    {"--plugin " RELIGN_BREAKS_DOWN " try", "breaks", "breaks_down"},
    {"try", "breaks", "breaks"},
    {"try", "nlopt-sb", "nlopt-sbplx", "./relign-bench"},
    {"try", "nlopt-sb", "nlopt-sbplx", "~/relign-bench"},
};

std::string with_escaped_spaces(const std::string& text) {
  std::string escaped;
  for (const char letter : text) escaped += letter == ' ' ? "\\ " : std::string(1, letter);
  return escaped;
}

std::string line_of(const Case& one, const std::string& word) {
  return one.program + (one.before.empty() ? "" : " ") + one.before + " " + with_escaped_spaces(word);
}

// A folder that is the shell's HOME, with the program on its PATH and files to complete.
class InteractiveShell : public testing::Test {
 protected:
  void SetUp() override {
    place_.write("my suites/one suite.json", "{}");
    place_.write("my suites/inside/x", "");
    place_.write("plain.json", "{}");
    ASSERT_EQ(shell(place_, "ln -s \"$RELIGN_BENCH\" relign-bench").exit_code, 0);
  }

  // Runs a script that prints a line for each case.
  std::vector<std::string> lines_printed(const std::string& name, const std::string& text, const std::string& command) {
    place_.write(name, text);
    std::string lines;
    for (const Case& one : kCases) lines += line_of(one, one.typed) + "\n";
    place_.write("lines", lines);
    const Outcome outcome = shell(place_, "export HOME=\"$PWD\" PATH=\"$PWD:$PATH\" TERM=dumb; " + command);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return lines_of(outcome.out);
  }

  // For shells that print the line as it is after a Tab.
  void expect_completed(const std::vector<std::string>& lines) {
    ASSERT_EQ(lines.size(), kCases.size()) << testing::PrintToString(lines);
    for (std::size_t i = 0; i < lines.size(); ++i)
      EXPECT_EQ(lines[i].substr(0, lines[i].find_last_not_of(' ') + 1), line_of(kCases[i], kCases[i].completed));
  }

  Workplace place_;
};

TEST_F(InteractiveShell, BashCompletes) {
  if (!installed("script")) GTEST_SKIP() << "script (Debian package bsdutils) is not installed";
  // Control-G prints the line and empties it.
  expect_completed(lines_printed("drive.bash", R"sh({
  echo 'PS1=; eval "$(relign-bench completion bash)"; bind "set bell-style none" "set enable-bracketed-paste off"'
  echo 'print_line() { echo "LINE<$READLINE_LINE>"; READLINE_LINE=; READLINE_POINT=0; }'
  echo $'bind -x \'"\\C-g": print_line\'; stty -echo'
  while IFS= read -r line; do printf '%s\t\a' "$line"; done < lines
  printf '\nexit\n'
} | script -qec "bash --norc --noprofile -i" /dev/null | tr -d '\r' | sed -n 's/.*LINE<\([^$].*\)>$/\1/p'
)sh",
                                 "exec bash drive.bash"));
}

TEST_F(InteractiveShell, ZshCompletes) {
  if (!installed("zsh")) GTEST_SKIP() << "zsh is not installed";
  expect_completed(lines_printed("drive.zsh",
                                 R"sh(relign-bench completion zsh > _relign-bench && zsh -n _relign-bench || exit
zmodload zsh/zpty
zpty shell "env PS1= zsh -f -i"
zpty -w shell 'PROMPT= RPROMPT=; unsetopt zle_bracketed_paste prompt_cr prompt_sp; fpath=($PWD $fpath)
autoload -Uz compinit; compinit -u -d $PWD/dump; bindkey "^I" complete-word
print_line() { print -r -- "LINE<$BUFFER>"; BUFFER=; zle accept-line }; zle -N print_line; bindkey "^G" print_line
print begin $((6 * 7))'
while zpty -r shell line && [[ $line != *begin\ 42* ]]; do :; done
while IFS= read -r typed; do
  zpty -w -n shell "$typed"$'\t\a'
  while zpty -r shell line; do [[ $line == *LINE\<* ]] && { print -r -- "${${line##*LINE<}%>*}"; break }; done
done < lines
zpty -d shell
)sh",
                                 "exec timeout 100 zsh -f drive.zsh"));
}

TEST_F(InteractiveShell, FishCompletes) {
  if (!installed("fish")) GTEST_SKIP() << "fish is not installed";
  // Prints the completions themselves, those of a line after one another, with a tab before descriptions.
  const std::vector<std::string> lines = lines_printed("drive.fish", R"sh(relign-bench completion fish > script.fish
fish --no-execute script.fish; and source script.fish; or exit 1
while read -l line
    echo (string join , -- (complete -C $line | string replace -r '\t.*' ''))
end < lines
)sh",
                                                       "exec fish --no-config drive.fish");
  ASSERT_EQ(lines.size(), kCases.size()) << testing::PrintToString(lines);
  for (std::size_t i = 0; i < lines.size(); ++i)
    EXPECT_EQ(lines[i].empty() ? kCases[i].typed : lines[i], kCases[i].completed)
        << line_of(kCases[i], kCases[i].typed);
}

TEST(Completion, RejectsUnknownShell) {
  const Outcome outcome = relign_bench(Workplace(), {"completion", "bahs"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, testing::HasSubstr("unknown shell 'bahs'; did you mean 'bash'?"));
}

}  // namespace
}  // namespace relign::cli_test
