// Damaged bytes in the files of a results folder.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace relign::records {

struct Damage {
  std::string file;
  std::size_t line = 0;  // from 1: the damaged line, or the closing line of the damaged block; 0: in `what`
  std::string trial;     // id; empty: unknown
  std::string what;      // "its lines do not have the checksum of its closing line"
  bool of_times = false;
};

// "results/quick/trials/0000.jsonl:1204: trial 4f1c0a9b2d3e4f50 is damaged: its lines do not ..."
std::string to_string(const Damage& damage);

// Throws Error(bad_input) that lists the damage, and how to mend it; does nothing if there is none.
void throw_if_damaged(const std::vector<Damage>& damaged);

}  // namespace relign::records
