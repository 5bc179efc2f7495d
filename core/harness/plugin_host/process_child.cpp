#include "plugin_host/process_child.h"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <thread>
#include <utility>

#include "base/error.h"
#include "plugin_host/confinement_status.h"
#include "plugin_host/process_session.h"

namespace relign::plugin_host {
namespace {

// The child's descriptors. Higher ones are closed in the child.
constexpr int kToHost = 3;
constexpr int kFromHost = 4;
constexpr int kPixels = 5;
constexpr int kFirstUnused = 6;

constexpr const char* kCrashOfSandbox = "crashed(sandbox)";
constexpr double kStopPollSeconds = 0.1;
constexpr std::chrono::microseconds kAwake{100};
constexpr std::size_t kMaxLineBytes = std::size_t{1} << 20;  // bytes of one message
constexpr std::size_t kLinesKept = 12;                       // of the output, for failure messages
constexpr std::size_t kLengthKept = 300;                     // of each of these lines
constexpr std::size_t kMaxOutputLineBytes = 1 << 16;         // passed on in one piece

[[noreturn]] void cannot_start(const std::vector<std::string>& command, int code) {
  const std::string name = command.empty() ? "" : command.front();
  throw Error(ErrorKind::plugin_rejected, "cannot start '" + name + "': " + std::strerror(code) +
                                              (code == ENOENT ? "; install it, or correct \"command\"" : ""));
}

// A close-on-exec copy whose number does not collide with those of the child.
Descriptor renumbered(Descriptor descriptor) { return Descriptor(::fcntl(descriptor.get(), F_DUPFD_CLOEXEC, 16)); }

class SpawnSettings {
 public:
  SpawnSettings() {
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawnattr_init(&attributes);
  }
  ~SpawnSettings() {
    ::posix_spawn_file_actions_destroy(&actions);
    ::posix_spawnattr_destroy(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
};

std::size_t page_bytes() { return static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)); }

std::vector<std::string> child_environment(const std::vector<std::string>& additions, bool inherits) {
  std::vector<std::string> all = additions;
  all.push_back("RELIGN_TO_HOST_FD=" + std::to_string(kToHost));
  all.push_back("RELIGN_FROM_HOST_FD=" + std::to_string(kFromHost));
  if (!inherits) return all;
  const std::size_t own = all.size();
  for (char** entry = environ; entry && *entry; ++entry) {
    const std::string_view text(*entry);
    const std::string_view name = text.substr(0, text.find('=') + 1);
    const bool replaced = std::any_of(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(own),
                                      [&](const std::string& mine) { return mine.compare(0, name.size(), name) == 0; });
    if (!replaced) all.emplace_back(text);
  }
  return all;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> list;
  for (std::string& text : texts) list.push_back(text.data());
  list.push_back(nullptr);
  return list;
}

int milliseconds_until(const Deadline& deadline) {
  if (!deadline) return -1;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(*deadline - ProcessClock::now()).count();
  return static_cast<int>(std::clamp<long long>(left, 0, 3'600'000));
}

Deadline earlier(const Deadline& a, const Deadline& b) { return !a ? b : !b ? a : std::min(*a, *b); }

std::string signal_text(int number) {
  const char* name = ::sigabbrev_np(number);
  return name ? std::string("SIG") + name : "signal " + std::to_string(number);
}

}  // namespace

Deadline in_seconds(double seconds) {
  return ProcessClock::now() +
         std::chrono::duration_cast<ProcessClock::duration>(std::chrono::duration<double>(seconds));
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    reset();
    number_ = other.release();
  }
  return *this;
}

int Descriptor::release() {
  const int number = number_;
  number_ = -1;
  return number;
}

void Descriptor::reset() {
  if (number_ >= 0) ::close(number_);
  number_ = -1;
}

std::string ChildProcess::pixel_path() { return "/proc/self/fd/" + std::to_string(kPixels); }

int ChildProcess::childs_pixel_file() { return kPixels; }

ChildProcess::ChildProcess(Options options) : options_(std::move(options)) { start(); }

ChildProcess::~ChildProcess() {
  end(0);
  if (pixels_) ::munmap(pixels_, page_bytes());
}

void ChildProcess::start() {
  int sockets[2], pipes[2];
  if (options_.command.empty()) cannot_start(options_.command, EINVAL);
  // A socket, not a pipe: writing without a reader returns an error and raises no signal.
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0) cannot_start(options_.command, errno);
  messages_ = Descriptor(sockets[0]);
  const Descriptor childs_messages = renumbered(Descriptor(sockets[1]));
  if (::pipe2(pipes, O_CLOEXEC) != 0) cannot_start(options_.command, errno);
  output_ = Descriptor(pipes[0]);
  const Descriptor childs_output = renumbered(Descriptor(pipes[1]));
  pixel_file_ = renumbered(Descriptor(::memfd_create("relign-pixels", MFD_CLOEXEC | MFD_ALLOW_SEALING)));
  if (childs_messages.get() < 0 || childs_output.get() < 0 || pixel_file_.get() < 0)
    cannot_start(options_.command, errno);
  ::fcntl(output_.get(), F_SETFL, O_NONBLOCK);
  if (options_.reads_pixels_only) map_pixels();

  SpawnSettings settings;
  ::posix_spawn_file_actions_addopen(&settings.actions, 0, "/dev/null", O_RDONLY, 0);
  for (const int number : {1, 2}) ::posix_spawn_file_actions_adddup2(&settings.actions, childs_output.get(), number);
  for (const int number : {kToHost, kFromHost})
    ::posix_spawn_file_actions_adddup2(&settings.actions, childs_messages.get(), number);
  ::posix_spawn_file_actions_adddup2(&settings.actions, pixel_file_.get(), kPixels);
  ::posix_spawn_file_actions_addclosefrom_np(&settings.actions, kFirstUnused);
  if (!options_.folder.empty()) ::posix_spawn_file_actions_addchdir_np(&settings.actions, options_.folder.c_str());
  sigset_t none, all;
  ::sigemptyset(&none);
  ::sigfillset(&all);
  ::posix_spawnattr_setsigmask(&settings.attributes, &none);
  ::posix_spawnattr_setsigdefault(&settings.attributes, &all);
  ::posix_spawnattr_setpgroup(&settings.attributes, 0);
  const int own = options_.leads_session ? POSIX_SPAWN_SETSID : POSIX_SPAWN_SETPGROUP;
  ::posix_spawnattr_setflags(&settings.attributes,
                             static_cast<short>(own | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF));

  std::vector<std::string> words = options_.command;
  std::vector<std::string> environment = child_environment(options_.environment, options_.inherits_environment);
  int code = 0;
  process_ = start_child([&] {
    pid_t made = -1;
    code = ::posix_spawnp(&made, words.front().c_str(), &settings.actions, &settings.attributes, pointers(words).data(),
                          pointers(environment).data());
    return code == 0 ? made : -1;
  });
  if (code != 0) {
    process_ = -1;
    cannot_start(options_.command, code);
  }
}

// Only mappings made before the seal can be written: this one, which the owner of the pixels enlarges.
void ChildProcess::map_pixels() {
  const std::size_t page = page_bytes();
  if (::ftruncate(pixel_file_.get(), static_cast<off_t>(page)) != 0) cannot_start(options_.command, errno);
  void* mapped = ::mmap(nullptr, page, PROT_READ | PROT_WRITE, MAP_SHARED, pixel_file_.get(), 0);
  if (mapped == MAP_FAILED || ::fcntl(pixel_file_.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_FUTURE_WRITE) != 0)
    cannot_start(options_.command, errno);
  pixels_ = mapped;
}

// ---- lines ------------------------------------------------------------------------------------

Deadline ChildProcess::with_stop(const Deadline& deadline) {
  if (!stop_deadline_ && options_.stop && options_.stop->load())
    stop_deadline_ = in_seconds(options_.seconds_after_stop);
  return earlier(deadline, stop_deadline_);
}

// Collects output first, so that what the child printed before its answer is logged before it.
bool ChildProcess::is_ready(short wanted, int milliseconds, bool& broken) {
  pollfd watched[2] = {{messages_.get(), wanted, 0}, {output_.get(), POLLIN, 0}};  // -1 is not watched
  const int ready = ::poll(watched, 2, milliseconds);
  broken = ready < 0 && errno != EINTR;
  if (ready <= 0) return false;
  if (watched[1].revents != 0) take_output();
  return watched[0].revents != 0;
}

bool ChildProcess::wait_until_ready(short wanted, Deadline given) {
  bool broken = false;
  // Polls for a moment before sleeping: waking a sleeping core takes longer than most answers do. Yields the core to
  // other work.
  const ProcessClock::time_point sleep_at = ProcessClock::now() + kAwake;
  do {
    if (is_ready(wanted, 0, broken)) return true;
    ::sched_yield();
  } while (ProcessClock::now() < sleep_at);
  while (!broken) {
    const Deadline deadline = with_stop(given);
    // A flag does not wake us up, so that we poll it.
    const bool polls_stop = options_.stop && !stop_deadline_;
    const Deadline wake = polls_stop ? earlier(deadline, in_seconds(kStopPollSeconds)) : deadline;
    if (is_ready(wanted, milliseconds_until(wake), broken)) return true;
    if (deadline && ProcessClock::now() >= *deadline) return false;
  }
  return false;
}

bool ChildProcess::send(std::string_view bytes, Deadline deadline) {
  while (!bytes.empty()) {
    if (!connected_) return false;
    const ssize_t sent = ::send(messages_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent >= 0) {
      bytes.remove_prefix(static_cast<std::size_t>(sent));
      continue;
    }
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) return false;
    if (!wait_until_ready(POLLOUT, deadline)) return false;
  }
  return true;
}

ChildProcess::Got ChildProcess::receive(std::string& line, Deadline deadline) {
  while (true) {
    const std::size_t newline = received_.find('\n', searched_);
    if (newline != std::string::npos) {
      line.assign(received_, 0, newline);
      received_.erase(0, newline + 1);
      searched_ = 0;
      line_deadline_.reset();
      return Got::line;
    }
    searched_ = received_.size();
    if (received_.size() > kMaxLineBytes) return Got::too_long;
    if (!connected_) return received_.empty() ? Got::end : Got::end_within_line;
    if (received_.empty())
      line_deadline_.reset();
    else if (!line_deadline_)
      line_deadline_ = in_seconds(options_.seconds_for_a_line);
    if (!wait_until_ready(POLLIN, earlier(deadline, line_deadline_)))
      return received_.empty() ? Got::late : Got::late_within_line;
    char buffer[1 << 14];
    const ssize_t got = ::recv(messages_.get(), buffer, sizeof buffer, MSG_DONTWAIT);
    if (got > 0)
      received_.append(buffer, static_cast<std::size_t>(got));
    else if (got == 0 || (errno != EINTR && errno != EAGAIN && errno != EWOULDBLOCK))
      connected_ = false;
  }
}

// ---- output -----------------------------------------------------------------------------------

void ChildProcess::take_output() {
  char buffer[1 << 14];
  // Bounded, because a child may print without end.
  for (int rounds = 0; rounds < 64 && output_.get() >= 0; ++rounds) {
    const ssize_t got = ::read(output_.get(), buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    if (got <= 0) {
      output_.reset();
      return;
    }
    for (const char letter : std::string_view(buffer, static_cast<std::size_t>(got))) {
      if (letter != '\n') output_line_ += letter;
      if (letter == '\n' || output_line_.size() >= kMaxOutputLineBytes)
        take_output_line(std::exchange(output_line_, {}));
    }
  }
}

void ChildProcess::take_output_line(std::string line) {
  if (options_.on_output) options_.on_output(line);
  line.resize(std::min(line.size(), kLengthKept));
  last_output_.push_back(std::move(line));
  if (last_output_.size() > kLinesKept) last_output_.pop_front();
}

// ---- the end ----------------------------------------------------------------------------------

void ChildProcess::terminate(double timeout_seconds) {
  if (process_ >= 0) ::kill(process_, SIGTERM);
  end(timeout_seconds);
}

void ChildProcess::end(double timeout_seconds) {
  if (process_ < 0) return;
  messages_.reset();
  connected_ = false;
  const Deadline deadline = in_seconds(timeout_seconds);
  int nap_microseconds = 100;
  while (!has_ended(process_)) {
    if (ProcessClock::now() >= *deadline) {
      killed_by_us_ = true;
      break;
    }
    if (output_.get() >= 0) take_output();
    std::this_thread::sleep_for(std::chrono::microseconds(nap_microseconds));
    nap_microseconds = std::min(2 * nap_microseconds, 5000);
  }
  // Until the leader is reaped, no other group or session can get this number.
  ::kill(-process_, SIGKILL);
  if (options_.leads_session) kill_session(process_);
  reap();
  take_output();
  if (!output_line_.empty()) take_output_line(std::exchange(output_line_, {}));
  if (crash_ == kCrashOfSandbox) take_reason_of_sandbox();
  output_.reset();
  pixel_file_.reset();
}

void ChildProcess::reap() {
  int status = 0;
  pid_t reaped = -1;
  do {
    reaped = ::waitpid(process_, &status, 0);
  } while (reaped < 0 && errno == EINTR);
  forget_child(process_);
  process_ = -1;
  if (reaped < 0)
    how_it_ended_ = "ended";
  else if (WIFEXITED(status) && options_.is_confined && WEXITSTATUS(status) == kEndedBySandbox) {
    crash_ = kCrashOfSandbox;
  } else if (WIFEXITED(status)) {
    how_it_ended_ = "ended with exit status " + std::to_string(WEXITSTATUS(status));
    crash_ = "crashed(exit " + std::to_string(WEXITSTATUS(status)) + ")";
  } else if (killed_by_us_) {
    how_it_ended_ = "was still running and was killed";
  } else {
    how_it_ended_ = "was killed by " + signal_text(WTERMSIG(status));
    crash_ = "crashed(" + signal_text(WTERMSIG(status)) + ")";
  }
}

// The last line, which relign-sandbox wrote when nothing else could write any more.
void ChildProcess::take_reason_of_sandbox() {
  how_it_ended_ = "was " + (last_output_.empty() ? kEndedPrefix : last_output_.back());
  if (!last_output_.empty()) last_output_.pop_back();
  if (!last_output_.empty() && last_output_.back().empty()) last_output_.pop_back();  // separates it from others
}

void append_number(std::string& text, double value) { text += std::isfinite(value) ? shortest(value) : "null"; }

void append_numbers(std::string& text, const double* values, std::size_t count) {
  text += '[';
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) text += ',';
    append_number(text, values[i]);
  }
  text += ']';
}

}  // namespace relign::plugin_host
