// A text of trials/ or times/ with new checksums: what a forger leaves who edits records.
#pragma once

#include <sstream>
#include <string>

#include "records/checksum.h"

namespace relign::records {

inline std::string resealed(const std::string& text) {
  std::istringstream lines(text);
  std::string sealed, block;
  for (std::string line; std::getline(lines, line);) {
    block += without_checksum(line);
    if (line.find("\"format\":") != std::string::npos) {  // the last of its block
      sealed += with_checksum(block) + "\n";
      block.clear();
    } else {
      block += "\n";
    }
  }
  return sealed + block;
}

}  // namespace relign::records
