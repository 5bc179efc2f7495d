#include "sandbox/supervisor.h"

#include <dirent.h>
#include <fcntl.h>
#include <linux/capability.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "sandbox/failure.h"
#include "sandbox/system_calls.h"

namespace relign::sandbox {
namespace {

using Nanoseconds = std::int64_t;

constexpr Nanoseconds kTick = 50'000'000;  // between looks at processes and memory
// Bounds what the kernel keeps for epoll and for descriptors in flight: a process can watch each pair of two files.
constexpr rlim_t kOpenFiles = 256;
constexpr int kHiddenLooks = 3;   // threads that are ending show no memory, either, but soon are gone
constexpr rlim_t kSignals = 256;  // that wait, timers included
// What a Unix socket may hold in the kernel: the default send buffer, which is the limit as SO_SNDBUF is refused, and
// one more message of half its size.
constexpr std::size_t kSocketBytes = 320'000;
constexpr rlim_t kThreads = 1024;                         // of all processes; RLIMIT_NPROC does not hold for root
constexpr unsigned kFirstOfPlugin = 3, kFirstUnused = 6;  // descriptors, as in plugin_host/process_child.cpp

int plugins_policy = SCHED_OTHER;  // by outrank_plugin()

Nanoseconds now() {
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * Nanoseconds{1'000'000'000} + time.tv_nsec;
}

void drop_capabilities() {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct none[2]{};
  require(::syscall(SYS_capset, &header, none) == 0, "cannot drop its capabilities");
}

void limit(int what, rlim_t most) {
  rlimit old{};
  if (::getrlimit(static_cast<__rlimit_resource>(what), &old) == 0 && old.rlim_max < most) most = old.rlim_max;
  const rlimit both{most, most};
  require(::setrlimit(static_cast<__rlimit_resource>(what), &both) == 0, "cannot set a limit");
}

[[noreturn]] void become(char** command, const char* folder, const Limits& limits) {
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  const sched_param ordinary{};
  require(::sched_setscheduler(0, plugins_policy, &ordinary) == 0, "cannot lower its priority");
  require(::setsid() >= 0, "cannot start a session");
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_NOFILE, kOpenFiles);
  limit(RLIMIT_NPROC, kThreads);
  limit(RLIMIT_FSIZE, limits.disk_bytes);
  for (const int unused : {RLIMIT_MSGQUEUE, RLIMIT_RTPRIO, RLIMIT_NICE}) limit(unused, 0);
  limit(RLIMIT_SIGPENDING, kSignals);
  if (limits.memory_bytes > 0) limit(RLIMIT_DATA, limits.memory_bytes);
  require(::chdir(folder) == 0, "cannot enter the plugin's folder");
  ::close_range(kFirstUnused, ~0U, 0);
  drop_capabilities();
  filter_system_calls();
  ::execvp(command[0], command);
  refuse(std::string("cannot start '") + command[0] + "'");
}

constexpr std::size_t kStatusBytes = 16384;  // lists the groups of the user

// Processes of the sandbox apart from this one, and the memory that they use.
struct Use {
  std::size_t processes = 0, threads = 0, bytes = 0;
  const char* unknown = nullptr;  // what could not be read, with errno in `problem`
  int problem = 0;
  bool hidden = false;  // a process has threads, none of which showed its memory

  void miss(const char* what) {
    unknown = what;
    problem = errno;
  }
};

// The text of a file of /proc up to `size` bytes; false with errno.
bool read_start(const char* path, char* text, std::size_t size) {
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const ssize_t count = ::read(file, text, size - 1);
  const int problem = errno;
  ::close(file);
  errno = problem;
  text[count > 0 ? count : 0] = 0;
  return count >= 0;
}

// A number in the text of a status file of proc(5), 0 without it. The plugin chooses the name in the first line, whose
// line ends the kernel escapes.
std::size_t number_after(const char* text, const char* name) {
  const char* const line = std::strstr(text, name);
  return line ? std::strtoull(line + std::strlen(name), nullptr, 10) : 0;
}

// A thread that has ended has none.
std::size_t memory_of(const char* text) {
  std::size_t kilobytes = 0;
  for (const char* name : {"\nVmRSS:", "\nVmPTE:", "\nVmSwap:", "\nHugetlbPages:"})
    kilobytes += number_after(text, name);
  return kilobytes * 1024;
}

// Of a process whose first thread has ended, by the entry of one that has not: they share all memory.
bool memory_of_threads(const std::string& process, std::size_t& bytes) {
  const std::string tasks = process + "/task";
  DIR* const folder = ::opendir(tasks.c_str());
  if (!folder) return false;
  char text[kStatusBytes];
  while (const dirent* entry = bytes == 0 ? ::readdir(folder) : nullptr)
    if (entry->d_name[0] != '.' && read_start((tasks + "/" + entry->d_name + "/status").c_str(), text, sizeof text))
      bytes = memory_of(text);
  ::closedir(folder);
  return true;
}

bool add_process(const std::string& process, Use& all) {
  char text[kStatusBytes];
  if (!read_start((process + "/status").c_str(), text, sizeof text)) return false;
  constexpr const char* kThreadsName = "\nThreads:";  // after the memory
  if (!std::strstr(text, kThreadsName)) return errno = EPROTO, false;
  const std::size_t threads = number_after(text, kThreadsName);
  std::size_t bytes = memory_of(text);
  if (bytes == 0 && threads > 1 && !memory_of_threads(process, bytes)) return false;
  all.threads += threads;
  all.bytes += bytes;
  all.hidden = all.hidden || (bytes == 0 && threads > 1);
  return true;
}

// Sockets of this network namespace, which is the sandbox's own; those without a process count as well.
bool count_sockets(std::size_t& sockets) {
  const int file = ::open("/proc/self/net/unix", O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  std::size_t lines = 0;
  char text[4096];
  ssize_t count = 0;
  while ((count = ::read(file, text, sizeof text)) > 0)
    lines += static_cast<std::size_t>(std::count(text, text + count, '\n'));
  ::close(file);
  sockets = lines > 0 ? lines - 1 : 0;  // without the heading
  return count == 0 && lines > 0;
}

// Reads nothing of them where there are more processes than `most`: among thousands, each wait for a processor may take
// seconds.
Use use(std::size_t most) {
  Use all;
  std::vector<std::string> names;
  DIR* const folder = ::opendir("/proc");
  if (!folder) return all.miss("its processes"), all;
  while (const dirent* entry = names.size() <= most ? ::readdir(folder) : nullptr)
    if (entry->d_name[0] >= '1' && entry->d_name[0] <= '9' && std::strcmp(entry->d_name, "1") != 0)
      names.emplace_back(entry->d_name);
  ::closedir(folder);
  all.processes = names.size();
  if (all.processes > most) return all;
  for (const std::string& name : names)
    if (!add_process("/proc/" + name, all) && errno != ENOENT && errno != ESRCH)  // it ended
      all.miss("the memory of its processes");
  std::size_t sockets = 0;
  if (!count_sockets(sockets)) all.miss("its sockets");
  all.bytes += sockets * kSocketBytes;
  return all;
}

// The reason to end it, in Ending; false if there is none.
template <std::size_t size>
bool exceeds(const Limits& limits, char (&reason)[size]) {
  static int hidden_looks = 0;
  Use used = use(limits.processes);
  hidden_looks = used.hidden ? hidden_looks + 1 : 0;
  if (hidden_looks == kHiddenLooks) errno = ESRCH, used.miss("the memory of short-lived threads");
  if (used.unknown)
    std::snprintf(reason, size, "%s cannot be counted: %s", used.unknown, std::strerror(used.problem));
  else if (used.processes > limits.processes)
    std::snprintf(reason, size, "more than %zu processes", limits.processes);
  else if (used.threads > kThreads)
    std::snprintf(reason, size, "more than %zu threads", static_cast<std::size_t>(kThreads));
  else if (limits.memory_bytes > 0 && used.bytes > limits.memory_bytes)
    std::snprintf(reason, size, "%zu MB of memory; at most %zu MB are allowed", used.bytes / 1'000'000,
                  limits.memory_bytes / 1'000'000);
  return reason[0] != 0;
}

}  // namespace

void outrank_plugin() {
  const int own = ::sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
  if (own != SCHED_OTHER && own != SCHED_BATCH && own != SCHED_IDLE) return;  // a real-time policy
  plugins_policy = own;
  const sched_param lowest{1};
  ::sched_setscheduler(0, SCHED_RR, &lowest);
}

Ending supervise(char** command, const char* folder, const Limits& limits) {
  // Blocked here and awaited below: no signal is lost between a look at the children and the wait.
  sigset_t child;
  ::sigemptyset(&child);
  ::sigaddset(&child, SIGCHLD);
  ::sigprocmask(SIG_BLOCK, &child, nullptr);
  const pid_t plugin = ::fork();
  require(plugin >= 0, "cannot start a process");
  if (plugin == 0) become(command, folder, limits);
  ::close_range(kFirstOfPlugin, kFirstUnused - 1, 0);  // the connection ends with the plugin
  drop_capabilities();
  Nanoseconds next_look = now();
  while (true) {
    Ending ending;
    const pid_t ended = ::waitpid(-1, &ending.status, WNOHANG);
    if (ended == plugin) return ending;
    // Not at every death: orphans without end would keep a process of high priority busy.
    if (now() >= next_look) {
      if (exceeds(limits, ending.reason)) return ending;
      next_look = now() + kTick;
    }
    if (ended > 0) continue;
    const timespec wait{0, std::max<Nanoseconds>(next_look - now(), 0)};
    ::sigtimedwait(&child, nullptr, &wait);
  }
}

}  // namespace relign::sandbox
