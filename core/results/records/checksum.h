// Checksums of records. The last line of a trial's block in trials/, and each line in times/, ends with the member
//   "sha256":"..."
// the SHA-256 of the block's lines, each with its newline, as they are without this member. It detects damaged bytes;
// an edited record may have an edited checksum, which only a replay shows.
#pragma once

#include <string>
#include <string_view>

namespace relign::records {

// `lines` (of one block, without the last newline) with their checksum.
std::string with_checksum(std::string_view lines);
// The same without it; lines that have none are returned as they are. A newline at the end stays.
std::string without_checksum(std::string_view lines);

struct SealedLine {
  std::string_view body;      // the line up to the checksum, without the brace that closes the object
  std::string_view checksum;  // empty: the line has none that can be read
};
SealedLine split_checksum(std::string_view line);

// Whether a line, which is a whole block, has its checksum.
bool line_is_intact(std::string_view line);

}  // namespace relign::records
