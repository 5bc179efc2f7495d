// The batch script that runs a plan as a Slurm job array: task i of the array runs shard i of the plan.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "cli/app.h"

namespace relign::cli {

struct SlurmScript {
  std::string name;  // of the suite; shown in the queue
  unsigned shards = 1;
  // Absolute paths: the working folder on a node may differ.
  std::filesystem::path program, plan, results;
  std::vector<std::filesystem::path> plugins;
  bool sandbox = false;  // of the plan
  unsigned cpus = 1;
  unsigned max_parallel = 0;  // 0: no limit
  std::string time;           // HH:MM:SS or D-HH:MM:SS
  std::string memory;         // per task, in Slurm's notation; empty: the cluster's default
  unsigned requeues = 0;      // how often a task that reached its time limit is requeued
};

// Names of files and users are untrusted: they are quoted for the shell and kept out of the lines that sbatch reads.
// Throws Error(bad_input) for a path with a control character.
std::string slurm_script_text(const SlurmScript& script);

// Array indices in sbatch's notation, such as "0-3,7,9". `indices` must be in rising order.
std::string slurm_array(const std::vector<unsigned>& indices);

void add_slurm_status(CLI::App& slurm, Context& context);  // below slurm

}  // namespace relign::cli
