// The batch script that runs a plan as a Slurm job array: one task of the array is one part of the plan.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace relign::cli {

struct SlurmScript {
  std::string name;  // of the suite; shown in the queue
  unsigned shards = 1;
  // Absolute: a node starts the script in a folder of its own choice.
  std::filesystem::path program, plan, results;
  std::vector<std::filesystem::path> plugins;
  unsigned cpus = 1;
  unsigned max_parallel = 0;  // 0: no limit
  std::string time;           // HH:MM:SS or D-HH:MM:SS
  std::string memory;         // of a task, as Slurm writes it; empty: the cluster's default
  unsigned requeues = 0;      // how often a task that its limit stopped asks to be started again
};

// Names come from files and users, and none of them reaches a shell unquoted or stands in a line that sbatch reads.
// Throws Error(bad_input) for a path with a control character.
std::string slurm_script_text(const SlurmScript& script);

// "0-3,7,9": indices of an array as sbatch takes them. `indices` in rising order.
std::string slurm_array(const std::vector<unsigned>& indices);

}  // namespace relign::cli
