// A plugin's process: starts it, exchanges lines with it, collects its output, ends it. Independent of JSON and Python;
// docs/process_plugins.md and process_plugin.h define the contents of the lines.
//
// The child leads a process group of its own, which is killed with it, so that none of its own children remains. A
// child that starts such groups itself leads a session, which is killed as a whole. It gets /dev/null as stdin, one
// pipe for stdout and stderr (its log), a two-way connection for messages under two descriptor numbers given in its
// environment, and a memory file for pixels. A child that dies cannot raise SIGPIPE in the host.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relign::plugin_host {

using ProcessClock = std::chrono::steady_clock;
using Deadline = std::optional<ProcessClock::time_point>;  // empty: no limit

Deadline in_seconds(double seconds);

// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  ~Descriptor() { reset(); }
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  int get() const { return number_; }
  int release();
  void reset();

 private:
  int number_;
};

class ChildProcess {
 public:
  struct Options {
    std::vector<std::string> command;      // found on PATH; words with a slash are relative to folder
    std::filesystem::path folder;          // the child's working directory
    std::vector<std::string> environment;  // "NAME=value", added to the host's own
    bool inherits_environment = true;      // false: not added to the host's own, of which the child gets nothing
    bool reads_pixels_only = false;        // the child cannot write into the pixel file
    bool leads_session = false;            // all processes of its session are killed with it
    bool is_confined = false;              // started by relign-sandbox
    double seconds_for_a_line = 5;         // from the first byte of a message to its end
    // Once it is true, every wait ends within `seconds_after_stop`. May be null.
    const std::atomic<bool>* stop = nullptr;
    double seconds_after_stop = 5;
    std::function<void(const std::string& line)> on_output;  // each line of its stdout and stderr; may be empty
  };
  // Throws Error(plugin_rejected) when the system cannot start the command.
  explicit ChildProcess(Options options);
  ~ChildProcess();  // kills the rest of the group
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  // False when the child has closed its side, or does not read before the deadline.
  bool send(std::string_view bytes, Deadline deadline);

  enum class Got { line, end, end_within_line, late, late_within_line, too_long };
  // Receives the next line, without its newline. Collects the child's output while waiting.
  Got receive(std::string& line, Deadline deadline);

  // Collects what the child has printed so far.
  void take_up_output() {
    if (output_.get() >= 0) take_output();
  }

  // Closes the connection, gives the child `timeout_seconds` to end by itself, collects its remaining output, kills
  // the group and reaps the child. Has no effect when called again.
  void end(double timeout_seconds);
  // The same for a child that hangs, after SIGTERM: a station stops its motors.
  void terminate(double timeout_seconds);
  // Whether a wait has noticed the flag `stop`.
  bool was_stopped() const { return stop_deadline_.has_value(); }

  // After end: "ended with exit status 3", "was killed by SIGSEGV", "was ended by the sandbox: more than 64 processes".
  const std::string& how_it_ended() const { return how_it_ended_; }
  // After end, for a child that ended by itself: "crashed(SIGSEGV)", "crashed(exit 3)"; "crashed(sandbox)" when its
  // sandbox ended it; empty when we killed it.
  const std::string& crash() const { return crash_; }
  // Killed by a SIGKILL that we did not send: by a user, or by a system short of memory.
  bool was_lost() const { return crash_ == "crashed(SIGKILL)"; }
  bool is_confined() const { return options_.is_confined; }
  pid_t process() const { return process_; }  // -1 after end
  // The last lines of stdout and stderr, shortened for messages.
  const std::deque<std::string>& last_output() const { return last_output_; }

  // A file in memory for pixels, and the path and descriptor number under which the child has it.
  int pixel_file() const { return pixel_file_.get(); }
  // The first page of the pixel file, mapped, for a caller who unmaps it; null unless reads_pixels_only.
  void* take_pixels() { return std::exchange(pixels_, nullptr); }
  static std::string pixel_path();
  static int childs_pixel_file();

 private:
  void start();
  void map_pixels();
  bool is_ready(short wanted, int milliseconds, bool& broken);
  bool wait_until_ready(short wanted, Deadline deadline);  // false: the deadline has passed
  Deadline with_stop(const Deadline& deadline);
  void take_output();
  void take_output_line(std::string line);
  void reap();
  void take_reason_of_sandbox();

  Options options_;
  pid_t process_ = -1;
  Descriptor messages_, output_, pixel_file_;
  void* pixels_ = nullptr;
  bool connected_ = true;
  std::string received_;
  std::size_t searched_ = 0;
  Deadline line_deadline_;  // for the end of a line that has begun
  Deadline stop_deadline_;  // set when options_.stop is true
  std::string output_line_;
  std::deque<std::string> last_output_;
  bool killed_by_us_ = false;
  std::string how_it_ended_, crash_;
};

// Numbers in messages: the shortest decimals that read back as the same double, null for non-finite numbers,
// independent of the locale. Faster than a JSON library: a step should cost microseconds.
void append_number(std::string& text, double value);
void append_numbers(std::string& text, const double* values, std::size_t count);  // "[1,0.5]"

}  // namespace relign::plugin_host
