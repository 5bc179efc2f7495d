#include "keeper.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <thread>

namespace relign::cluster_test {
namespace {

// A shell with a child and a detached process, like a daemon. Each keeps the pipe open as long as it lives, and writes
// a letter when it has started.
std::vector<std::string> a_family(int pipe) {
  const std::string speaks = "sh -c 'printf x >&" + std::to_string(pipe) + "; sleep 1000' & ";
  return {"/bin/sh", "-c", speaks + "( setsid " + speaks + ") ; wait"};
}

bool readable_within_20_s(int pipe) {
  pollfd waiting = {pipe, POLLIN, 0};
  return ::poll(&waiting, 1, 20000) == 1;
}

bool within_20_s(const std::function<bool()>& true_now) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!true_now()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

class TheKeeper : public testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(::pipe(ends_), 0); }
  void TearDown() override { ::close(ends_[0]); }
  void expect_two_letters() const {
    char letter = 0;
    for (int i = 0; i < 2; ++i) {
      ASSERT_TRUE(readable_within_20_s(ends_[0]));
      ASSERT_EQ(::read(ends_[0], &letter, 1), 1);
    }
  }
  void expect_that_all_have_ended() const {
    char letter = 0;
    ASSERT_TRUE(readable_within_20_s(ends_[0])) << "a process still has the pipe open";
    EXPECT_EQ(::read(ends_[0], &letter, 1), 0);
  }

  int ends_[2] = {-1, -1};
};

TEST_F(TheKeeper, EndsStartedProcesses) {
  {
    const Keeper keeper;
    const pid_t shell = keeper.start(a_family(ends_[1]));
    ::close(ends_[1]);
    expect_two_letters();
    EXPECT_TRUE(keeper.alive(shell));
    // The letters are written before the processes that the two wait for have started.
    EXPECT_TRUE(within_20_s([&] { return keeper.kept().size() >= 5U; }))
        << "expected the shell, two others, and the processes that they wait for; found " << keeper.kept().size();
    ::kill(shell, SIGKILL);
    EXPECT_TRUE(within_20_s([&] { return !keeper.alive(shell); }));
    EXPECT_GE(keeper.kept().size(), 4U) << "orphans must be included";
  }
  expect_that_all_have_ended();
}

// A child that has not called exec yet, as a subshell never does.
TEST_F(TheKeeper, TellsProgramsFromTheirStartingChildren) {
  const Keeper keeper;
  const std::string script = "( printf xx >&" + std::to_string(ends_[1]) + "; sleep 1000; : ); :";
  const pid_t shell = keeper.start({"/bin/sh", "-c", script});
  ::close(ends_[1]);
  expect_two_letters();
  // Until it calls exec, the program for which the subshell waits is a shell, too.
  EXPECT_TRUE(within_20_s([&] {
    const std::vector<Process> kept = keeper.kept();
    return std::any_of(kept.begin(), kept.end(), [](const Process& one) { return one.command.rfind("sleep", 0) == 0; });
  }));
  std::vector<Process> shells;
  for (Process& process : keeper.kept())
    if (process.command.rfind("/bin/sh", 0) == 0) shells.push_back(std::move(process));
  ASSERT_EQ(shells.size(), 2U);
  EXPECT_EQ(without_starting_children(shells), std::vector<pid_t>{shell});
}

TEST_F(TheKeeper, EndsProcessesOfAKilledTest) {
  const pid_t test = ::fork();
  if (test == 0) {
    const Keeper keeper;
    keeper.start(a_family(ends_[1]));
    ::close(ends_[1]);
    while (true) ::pause();
  }
  ::close(ends_[1]);
  expect_two_letters();
  ::kill(test, SIGKILL);
  ::waitpid(test, nullptr, 0);
  expect_that_all_have_ended();
}

}  // namespace
}  // namespace relign::cluster_test
