// A Slurm of two nodes on this machine, from the distribution's packages: own configuration, ports and folders, no
// accounts, no other daemons. For throw-away clusters only: whoever reaches its ports may run jobs in it.
#pragma once

#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

#include "cli/program.h"

namespace relign::cluster_test {

class SlurmCluster {
 public:
  SlurmCluster();
  ~SlurmCluster();  // ends every process that descends from this one
  SlurmCluster(const SlurmCluster&) = delete;
  SlurmCluster& operator=(const SlurmCluster&) = delete;

  // Why there is no cluster; empty when both nodes are ready.
  const std::string& problem() const { return problem_; }
  // The environment of sbatch and the others.
  const cli_test::Options& options() const { return options_; }

  // Kills a node's daemon and what watches over its jobs, while the jobs go on; the controller is told that it is lost.
  void lose_node(const std::string& node, const std::vector<std::string>& job_ids);

 private:
  void start_node(const std::string& node);
  void wait_until_ready();

  cli_test::Workplace place_;
  cli_test::Options options_;
  std::string problem_;
  std::string controller_program_, node_program_, config_;
  std::unique_ptr<cli_test::Running> controller_, first_, second_;
};

struct Process {
  pid_t id = 0, parent = 0;
  std::string command;  // words separated by blanks
};
// All processes below this one. Orphans among them are this one's children, once a SlurmCluster was made.
std::vector<Process> descendants();

}  // namespace relign::cluster_test
