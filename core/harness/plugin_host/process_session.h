// Processes that plugins started, from /proc: those of a worker's session, and orphans that left it.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <set>
#include <vector>

namespace relign::plugin_host {

// Excludes processes that have ended and wait to be reaped.
std::vector<pid_t> processes_of_session(pid_t session);

// Sends SIGKILL to every process of the session except `spared`, until none is left.
void kill_session(pid_t session, pid_t spared = -1);

// Memory in use by a process, shared pages included; 0 when it has ended.
std::size_t resident_bytes(pid_t process);

// From now on, a process whose parent ends becomes a child of this one (subreaper) instead of the system's, so that
// daemons of plugins can be found. For programs whose children are all started by start_child.
void adopt_orphans();

// Starts a child, by a function that returns its number or -1, which is not an orphan until it is given to
// forget_child.
pid_t start_child(const std::function<pid_t()>& start);
void forget_child(pid_t process);

// Whether a child has ended, reaped or not.
bool has_ended(pid_t child);

// Of a process that was asked to end, before it is killed.
inline constexpr double kSecondsToExit = 2;

// Asks the children of start_child to end, by SIGTERM, and waits until they have, for kSecondsToExit at most: a station
// stops its motors.
void end_children();

// Children of this process that start_child did not start; empty without adopt_orphans.
std::set<pid_t> orphans();
// Kills and reaps all of them except `spared`, with what they started.
void kill_orphans(const std::set<pid_t>& spared = {});
// Kills everything that this process and its descendants started.
void kill_descendants();

// Kills at its end the orphans that were not there at its beginning.
class OrphanWatch {
 public:
  OrphanWatch() : before_(orphans()) {}
  ~OrphanWatch() { kill_orphans(before_); }
  OrphanWatch(const OrphanWatch&) = delete;
  OrphanWatch& operator=(const OrphanWatch&) = delete;

 private:
  std::set<pid_t> before_;
};

}  // namespace relign::plugin_host
