// Starts programs that must not outlive the test, however it ends: a process between the test and them, which ends
// all that descends from it as soon as the test is gone. A death signal would reach the daemons alone, and not what
// they have started and left behind.
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

  // Starts a program by its whole path, with stdin, stdout and stderr at /dev/null; its process id.
  pid_t start(const std::vector<std::string>& command) const;
  // All living processes below it, orphans included.
  std::vector<Process> kept() const;
  bool alive(pid_t process) const;

 private:
  int connection_ = -1;
  pid_t process_ = -1;
};

}  // namespace relign::cluster_test
