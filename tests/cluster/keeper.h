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
