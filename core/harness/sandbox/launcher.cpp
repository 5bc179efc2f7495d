// relign-sandbox: runs a command as `--sandbox` promises (docs/sandbox.md), in name spaces of its own, without rights,
// with limits. Started by plugin_host/confinement.cpp, which gives it the descriptors and the environment of a plugin.
//
//   relign-sandbox [show|hide PATH | folder DIR | memory|processes|disk COUNT]... -- COMMAND...
//   relign-sandbox -- (without a command)      builds a sandbox, and ends: exit status 0 where the system allows it
//
// This process stays outside and waits; process 1 of the new process namespace is supervisor.h, process 2 the command.
// Whatever ends this process (SIGKILL, the death of its own parent) ends the whole sandbox.
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>
#include <vector>

#include "plugin_host/confinement_status.h"
#include "sandbox/failure.h"
#include "sandbox/file_view.h"
#include "sandbox/supervisor.h"
#include "sandbox/system_calls.h"

namespace relign::sandbox {
namespace {

using plugin_host::kCannotConfine;
using plugin_host::kEndedBySandbox;
using plugin_host::kEndedPrefix;

constexpr const char* kUserInside = "1000";

struct Arguments {
  std::vector<Mount> mounts;
  std::string folder = "/";
  Limits limits;
  std::vector<std::string> command;
};

Arguments read(int count, char** words) {
  Arguments arguments;
  int at = 1;
  for (; at + 1 < count && std::string_view(words[at]) != "--"; at += 2) {
    const std::string key = words[at], value = words[at + 1];
    if (key == "show")
      arguments.mounts.push_back({Mount::Kind::read_only, value});
    else if (key == "hide")
      arguments.mounts.push_back({Mount::Kind::hidden, value});
    else if (key == "folder")
      arguments.folder = value;
    else if (key == "memory")
      arguments.limits.memory_bytes = std::strtoull(value.c_str(), nullptr, 10);
    else if (key == "processes")
      arguments.limits.processes = std::strtoull(value.c_str(), nullptr, 10);
    else if (key == "disk")
      arguments.limits.disk_bytes = std::strtoull(value.c_str(), nullptr, 10);
    else
      refuse("'relign-sandbox' is an internal program of relign-bench", 0);
  }
  for (++at; at < count; ++at) arguments.command.emplace_back(words[at]);
  // /proc/1/cmdline shows them to the plugin: no paths of the user.
  for (int i = 1; i < count; ++i) std::memset(words[i], 0, std::strlen(words[i]));
  return arguments;
}

void write_to(const char* path, const std::string& text) {
  const int file = ::open(path, O_WRONLY | O_CLOEXEC);
  if (file < 0 || ::write(file, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    refuse(std::string("cannot write '") + path +
           "' (on Ubuntu 24.04, 'sysctl kernel.apparmor_restrict_unprivileged_userns=0' allows it)");
  ::close(file);
}

void enter_namespaces() {
  const std::string user = std::to_string(::geteuid()), group = std::to_string(::getegid());
  require(::unshare(CLONE_NEWUSER) == 0,
          "cannot create a user namespace (see the kernel's user.max_user_namespaces, and on Debian "
          "kernel.unprivileged_userns_clone)");
  write_to("/proc/self/setgroups", "deny");
  write_to("/proc/self/uid_map", kUserInside + (" " + user) + " 1");
  write_to("/proc/self/gid_map", kUserInside + (" " + group) + " 1");
  require(::unshare(CLONE_NEWNS | CLONE_NEWPID | CLONE_NEWNET | CLONE_NEWIPC | CLONE_NEWUTS | CLONE_NEWCGROUP) == 0,
          "cannot create name spaces");
  // An algorithm does not observe the machine's name.
  require(::sethostname("sandbox", 7) == 0, "cannot change the host name");
}

// Once every process of the sandbox is dead: what they left in the pipe comes before, and none of them takes it away.
[[noreturn]] void end_for(const char* reason) {
  ::fcntl(STDERR_FILENO, F_SETFL, 0);                          // the plugin may have made it O_NONBLOCK
  ::dprintf(STDERR_FILENO, "\n%s%s\n", kEndedPrefix, reason);  // it may have left a line without an end
  ::_exit(kEndedBySandbox);
}

// Ends as the plugin did, so that the message on the trial names its signal or exit status.
[[noreturn]] void end_as(int status) {
  if (WIFSIGNALED(status)) {
    const rlimit none{0, 0};
    ::setrlimit(RLIMIT_CORE, &none);
    ::signal(WTERMSIG(status), SIG_DFL);
    ::kill(::getpid(), WTERMSIG(status));
  }
  const int exited = WIFEXITED(status) ? WEXITSTATUS(status) : kCannotConfine;
  ::_exit(exited == kEndedBySandbox ? EXIT_FAILURE : exited);
}

[[noreturn]] void wait_for(pid_t supervisor, int report, pid_t parent) {
  constexpr int kMilliseconds = 200;
  pollfd watched{report, POLLIN, 0};
  while (::poll(&watched, 1, kMilliseconds) <= 0)
    if (::getppid() != parent) ::_exit(kCannotConfine);  // its result is not needed any more; ends the supervisor
  Ending ending;
  const bool reported = ::read(report, &ending, sizeof ending) == sizeof ending;
  int own = 0;
  while (::waitpid(supervisor, &own, 0) < 0 && errno == EINTR) {
  }
  if (reported && ending.reason[0]) end_for(ending.reason);
  end_as(reported ? ending.status : own);
}

int run(int count, char** words) {
  const pid_t parent = ::getppid();
  // The plugin's descriptors (0 to 5) are closed here by number: no other file may get one of them.
  int last = -1;
  do last = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  while (last >= 0 && last <= 5);
  ::close(last);
  Arguments arguments = read(count, words);
  outrank_plugin();  // outside, where root has the right to
  enter_namespaces();
  FileView view(std::move(arguments.mounts));
  int report[2];
  require(::pipe2(report, O_CLOEXEC) == 0, "cannot make a pipe");
  ::prctl(PR_SET_DUMPABLE, 0, 0, 0, 0);  // the plugin has the same user, and could read this memory
  const pid_t supervisor = ::fork();
  require(supervisor >= 0, "cannot start a process");
  if (supervisor > 0) {
    ::close_range(3, 5, 0);
    ::close(report[1]);
    wait_for(supervisor, report[0], parent);
  }
  ::prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0);
  ::close(report[0]);
  pollfd gone{report[1], 0, 0};
  if (::poll(&gone, 1, 0) > 0) ::_exit(kCannotConfine);  // the launcher died before the line above
  view.enter(arguments.limits.disk_bytes);
  Ending ending;
  if (arguments.command.empty()) {
    filter_system_calls();
  } else {
    std::vector<char*> command;
    for (std::string& word : arguments.command) command.push_back(word.data());
    command.push_back(nullptr);
    ending = supervise(command.data(), arguments.folder.c_str(), arguments.limits);
  }
  if (::write(report[1], &ending, sizeof ending) != sizeof ending) return kCannotConfine;
  return 0;
}

}  // namespace
}  // namespace relign::sandbox

int main(int count, char** words) { return relign::sandbox::run(count, words); }
