// Starts programs that must not outlive the test, however it ends: a process between the test and the programs, which
// kills all its descendants when the test has ended. A parent-death signal would reach only the daemons, and not the
// processes that they have started.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace relign::cluster_test {

struct Process {
  pid_t id = 0, parent = 0;
  std::string command;  // words separated by blanks
};

// The ids of those processes whose parent is not among them. A program that starts another one has a child with its own
// command line until that calls exec.
std::vector<pid_t> without_starting_children(const std::vector<Process>& processes);

class Keeper {
 public:
  Keeper();
  ~Keeper();  // returns when everything has ended
  Keeper(const Keeper&) = delete;
  Keeper& operator=(const Keeper&) = delete;

  // Starts a program by its full path, with stdin, stdout and stderr at /dev/null. Returns its process id.
  pid_t start(const std::vector<std::string>& command) const;
  // All living descendants, including orphans.
  std::vector<Process> kept() const;
  bool alive(pid_t process) const;

 private:
  int connection_ = -1;
  pid_t process_ = -1;
};

}  // namespace relign::cluster_test
