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

#include "sandbox/failure.h"
#include "sandbox/system_calls.h"

namespace relign::sandbox {
namespace {

using Nanoseconds = std::int64_t;

constexpr Nanoseconds kTick = 50'000'000;  // between looks at processes and memory
constexpr rlim_t kOpenFiles = 1024;
// What a Unix socket may hold in the kernel: the default send buffer, which is the limit as SO_SNDBUF is refused, and
// one more message of half its size.
constexpr std::size_t kSocketBytes = 320'000;
constexpr rlim_t kThreads = 1024;                         // of all processes; RLIMIT_NPROC does not hold for root
constexpr unsigned kFirstOfPlugin = 3, kFirstUnused = 6;  // descriptors, as in plugin_host/process_child.cpp

bool outranks = false;  // outrank_plugin() succeeded

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
  if (outranks) require(::sched_setscheduler(0, SCHED_OTHER, &ordinary) == 0, "cannot lower its priority");
  require(::setsid() >= 0, "cannot start a session");
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_NOFILE, kOpenFiles);
  limit(RLIMIT_NPROC, kThreads);
  limit(RLIMIT_FSIZE, limits.disk_bytes);
  limit(RLIMIT_MSGQUEUE, 0);
  if (limits.memory_bytes > 0) limit(RLIMIT_DATA, limits.memory_bytes);
  require(::chdir(folder) == 0, "cannot enter the plugin's folder");
  ::close_range(kFirstUnused, ~0U, 0);
  drop_capabilities();
  filter_system_calls();
  ::execvp(command[0], command);
  refuse(std::string("cannot start '") + command[0] + "'");
}

// Processes of the sandbox apart from this one, and the memory that they use.
struct Use {
  std::size_t processes = 0, threads = 0, bytes = 0;
  const char* unknown = nullptr;  // what could not be read
};

// In /proc/PID/stat after the name: fields 20 and 24 of proc(5).
constexpr const char* kThreadsAndPages =
    ") %*c %*d %*d %*d %*d %*d %*u %*u %*u %*u %*u %*u %*u %*d %*d %*d %*d %lu %*d %*u %*u %lu";

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

// Stops counting at more processes than `most`: where they are thousands, a look at all of them would take seconds of
// waiting for a processor.
Use use(std::size_t most) {
  constexpr const char* kMemory = "the memory of its processes";
  static const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  Use all;
  DIR* const folder = ::opendir("/proc");
  if (!folder) return {0, 0, 0, "its processes"};
  while (const dirent* entry = ::readdir(folder)) {
    if (entry->d_name[0] < '1' || entry->d_name[0] > '9' || std::strcmp(entry->d_name, "1") == 0) continue;
    if (++all.processes > most) break;
    const std::string path = std::string("/proc/") + entry->d_name + "/stat";
    char text[1024];
    unsigned long threads = 0, resident = 0;
    if (read_start(path.c_str(), text, sizeof text)) {
      const char* const rest = std::strrchr(text, ')');  // the plugin chooses the name before it
      if (rest && std::sscanf(rest, kThreadsAndPages, &threads, &resident) != 2) all.unknown = kMemory;
      all.threads += threads;
      all.bytes += resident * page;
    } else if (errno != ENOENT && errno != ESRCH) {  // it ended
      all.unknown = kMemory;
    }
  }
  ::closedir(folder);
  std::size_t sockets = 0;
  if (!count_sockets(sockets)) all.unknown = "its sockets";
  all.bytes += sockets * kSocketBytes;
  return all;
}

bool within(const Limits& limits) {
  const Use used = use(limits.processes);
  if (used.unknown)
    std::fprintf(stderr, "sandbox: ended because %s cannot be counted: %s\n", used.unknown, std::strerror(errno));
  else if (used.processes > limits.processes)
    std::fprintf(stderr, "sandbox: ended for more than %zu processes\n", limits.processes);
  else if (used.threads > kThreads)
    std::fprintf(stderr, "sandbox: ended for more than %zu threads\n", static_cast<std::size_t>(kThreads));
  else if (limits.memory_bytes > 0 && used.bytes > limits.memory_bytes)
    std::fprintf(stderr, "sandbox: ended for %zu MB of memory; at most %zu MB are allowed\n", used.bytes / 1'000'000,
                 limits.memory_bytes / 1'000'000);
  else
    return true;
  return false;
}

}  // namespace

void outrank_plugin() {
  const sched_param lowest{1};
  outranks = ::sched_getscheduler(0) == SCHED_OTHER && ::sched_setscheduler(0, SCHED_RR, &lowest) == 0;
}

int supervise(char** command, const char* folder, const Limits& limits) {
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
  constexpr int kEnded = 1 << 8;  // the wait status of exit(1)
  Nanoseconds next_look = now();
  while (true) {
    int status = 0;
    const pid_t ended = ::waitpid(-1, &status, WNOHANG);
    if (ended == plugin) return status;
    // Not at every death: orphans without end would keep a process of high priority busy.
    if (now() >= next_look) {
      if (!within(limits)) return kEnded;
      next_look = now() + kTick;
    }
    if (ended > 0) continue;
    const timespec wait{0, std::max<Nanoseconds>(next_look - now(), 0)};
    ::sigtimedwait(&child, nullptr, &wait);
  }
}

}  // namespace relign::sandbox
