// A Slurm cluster of two nodes on this machine, from the distribution's packages: own configuration, ports and folders,
// no accounts, no other daemons. For temporary clusters only: anyone who can reach its ports can run jobs.
#pragma once

#include <sys/types.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "cli/program.h"
#include "keeper.h"

namespace relign::cluster_test {

// Polls until `holds` returns true. False after 40 s, which is far longer than necessary on a shared machine, or when
// all waits of this program together have taken 100 s: then another wait would fail as well.
bool wait_for(const std::function<bool()>& holds);
bool waited_too_long();

class SlurmCluster {
 public:
  SlurmCluster();

  // The reason why there is no cluster; empty when both nodes are ready.
  const std::string& problem() const { return problem_; }
  // Runs a shell script in this folder with the cluster's sbatch, squeue and so on.
  cli_test::Outcome shell(const cli_test::Workplace& place, const std::string& script) const;
  // The daemons, the jobs, and processes that these have detached.
  std::vector<Process> processes() const { return keeper_.kept(); }

  // Simulates a node lost by the network, whose programs continue: kills its daemon and the supervisors of its jobs,
  // and reports it to the controller.
  void lose_node(const std::string& node);
  // Starts its daemon again; the controller notices after a while.
  void return_node(const std::string& node);

 private:
  pid_t start(const std::string& program, const std::string& log, const std::vector<std::string>& options) const;
  std::string said(const std::string& script) const { return shell(place_, script).out; }

  cli_test::Workplace place_;
  std::string problem_, node_program_, config_;
  std::map<std::string, pid_t> nodes_;
  Keeper keeper_;  // last member, destroyed first: ends the processes that write to the folder
};

}  // namespace relign::cluster_test
