// The processes of a session, from /proc: a worker and the processes of its plugins.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <vector>

namespace relign::plugin_host {

// Excludes processes that have ended and wait to be reaped.
std::vector<pid_t> processes_of_session(pid_t session);

// Sends SIGKILL to every process of the session except `spared`, until none is left.
void kill_session(pid_t session, pid_t spared = -1);

// Memory in use by a process, shared pages included; 0 when it has ended.
std::size_t resident_bytes(pid_t process);

}  // namespace relign::plugin_host
