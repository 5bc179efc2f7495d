// kill -9 of workers and of the whole program at random moments: the same command resumes and finally writes the same
// results as an uninterrupted run. RELIGN_KILLS=100 for the long form.
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <random>
#include <thread>

#include "toy_suites.h"

namespace relign::runner {
namespace {

class KillTest : public ToyTest {
 protected:
  void SetUp() override {
    ToyTest::SetUp();
    std::ofstream(folder_ / "toy.json") << R"({"scenes": ["toy-scene"], "noise_levels": ["toy-level", "toy-wild"],
      "instances": 150, "steps": 8, "algorithms": ["toy-walker", "toy-stumbler",
        {"use": "toy-walker", "name": "short-walker", "steps": 3}, {"use": "toy-saboteur", "name": "printer",
         "parameters": {"deed": "print"}}]})";
  }

  pid_t start(const std::string& name) {
    const fs::path plugins = RELIGN_RUNNER_TEST_PLUGINS;
    std::vector<std::string> words = {RELIGN_PROGRAM, "run", folder_ / "toy.json", "-o",  folder_ / name,
                                      "--workers",    "3",   "--progress",         "none"};
    for (const char* plugin : {"toy_scene", "toy_level", "toy_walker", "toy_stumbler", "toy_saboteur"}) {
      words.emplace_back("--plugin");
      words.push_back(plugins / plugin);
    }
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    const std::string log = folder_ / "log.txt";
    for (const int number : {STDOUT_FILENO, STDERR_FILENO})
      ::posix_spawn_file_actions_addopen(&files, number, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    pid_t program = -1;
    EXPECT_EQ(::posix_spawn(&program, RELIGN_PROGRAM, &files, nullptr, pointers.data(), environ), 0);
    ::posix_spawn_file_actions_destroy(&files);
    return program;
  }

  static std::vector<pid_t> children_of(pid_t program) {
    std::vector<pid_t> found;
    std::error_code code;
    for (const auto& thread : fs::directory_iterator("/proc/" + std::to_string(program) + "/task", code)) {
      std::ifstream list(thread.path() / "children");
      for (pid_t child; list >> child;) found.push_back(child);
    }
    return found;
  }

  // The exit status if it ends within the time.
  static std::optional<int> ended_within(pid_t program, double seconds) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    int status = 0;
    while (::waitpid(program, &status, WNOHANG) == 0) {
      if (std::chrono::steady_clock::now() > deadline) return std::nullopt;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  // The files that must be equal; the others depend on time and place.
  std::map<std::string, std::string> results(const std::string& name) const {
    std::map<std::string, std::string> files = contents(name);
    files.erase("report.html");    // contains times
    files.erase("manifest.json");  // contains the folder's name and the date
    return files;
  }

  // The names of files that differ; empty if none does.
  static std::string differences(const std::map<std::string, std::string>& found,
                                 const std::map<std::string, std::string>& expected) {
    std::string text;
    for (const auto& [file, content] : expected)
      if (const auto same = found.find(file); same == found.end())
        text += file + " is missing\n";
      else if (same->second != content)
        text += file + " differs: " + std::to_string(same->second.size()) + " bytes instead of " +
                std::to_string(content.size()) + "\n";
    for (const auto& [file, content] : found)
      if (!expected.count(file)) text += file + " is superfluous\n";
    return text;
  }

  std::string log() const { return fs::exists(folder_ / "log.txt") ? read_file(folder_ / "log.txt") : ""; }
};

TEST_F(KillTest, ResumesAfterKill) {
  const char* wanted = std::getenv("RELIGN_KILLS");
  const int kills = wanted ? std::atoi(wanted) : 15;
  constexpr int kTrialsFailed = 3;  // the stumbler's
  ASSERT_EQ(ended_within(start("undisturbed"), 100), kTrialsFailed) << log();
  const auto undisturbed = results("undisturbed");
  ASSERT_GT(undisturbed.size(), 100U);

  std::mt19937 random(20261121);
  std::uniform_real_distribution<double> moment(0.02, 0.4);
  int killed = 0, programs = 0, runs = 0;
  for (; killed < kills; ++runs) {
    const std::string name = "run-" + std::to_string(runs);
    bool done = false;
    while (!done) {
      const pid_t program = start(name);
      std::optional<int> status;
      while (!(status = ended_within(program, killed < kills ? moment(random) : 100))) {
        ASSERT_LT(killed, kills) << "it hangs\n" << log();
        const std::vector<pid_t> workers = children_of(program);
        ++killed;
        if (!workers.empty() && random() % 3 != 0) {
          ::kill(workers[random() % workers.size()], SIGKILL);
          continue;
        }
        ++programs;
        ::kill(program, SIGKILL);
        // Wait until the workers have ended by themselves and write no more.
        for (const pid_t worker : workers)
          for (int wait = 0; wait < 1000 && ::kill(worker, 0) == 0; ++wait)
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
      ASSERT_TRUE(*status == kTrialsFailed || *status == -1) << log();
      done = *status == kTrialsFailed;
    }
    EXPECT_EQ(differences(results(name), undisturbed), "") << name;
    fs::remove_all(folder_ / name);
  }
  std::printf("%d kills in %d runs, %d of them of the program\n", killed, runs, programs);
}

}  // namespace
}  // namespace relign::runner
