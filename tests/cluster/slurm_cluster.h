// A Slurm of two nodes on this machine, from the distribution's packages: own configuration, ports and folders, no
// accounts, no other daemons. For throw-away clusters only: whoever reaches its ports may run jobs in it.
#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "cli/program.h"
#include "keeper.h"

namespace relign::cluster_test {

// Asks until it is so. False after 40 s, which is far longer than anything takes on a shared machine, or when all waits
// of this program together have had 100 s: then something is wrong that the next test would only wait for again.
bool wait_for(const std::function<bool()>& holds);
bool waited_too_long();

class SlurmCluster {
 public:
  SlurmCluster();

  // Why there is no cluster; empty when both nodes are ready.
  const std::string& problem() const { return problem_; }
  // A shell script in this folder that finds the cluster's sbatch, squeue and the others.
  cli_test::Outcome shell(const cli_test::Workplace& place, const std::string& script) const;
  // The daemons, the jobs, and what these have left behind.
  std::vector<Process> processes() const { return keeper_.kept(); }

  // As when the network has lost a node whose programs go on: its daemon is killed, and what watches over its jobs; the
  // controller is told.
  void lose_node(const std::string& node);
  // Its daemon starts again; the controller learns it by and by.
  void return_node(const std::string& node);

 private:
  pid_t start(const std::string& program, const std::string& log, const std::vector<std::string>& options) const;
  std::string said(const std::string& script) const { return shell(place_, script).out; }

  cli_test::Workplace place_;
  std::string problem_, node_program_, config_;
  std::map<std::string, pid_t> nodes_;
  Keeper keeper_;  // the first to go: it ends what writes to the folder
};

}  // namespace relign::cluster_test
