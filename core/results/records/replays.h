// verify.json of a results folder: how many of its trials were replayed, by whom and with which program. A statement of
// the one who wrote it; it counts only for the records that it names by their hash.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "base/json_source.h"

namespace relign::records {

struct ReplayCounts {
  std::size_t recorded = 0, replayed = 0, equal = 0;  // trials
};

struct Replays {
  ReplayCounts all;
  std::map<std::pair<std::string, std::string>, ReplayCounts> methods;  // by name and protocol
  std::string by;                                                       // as given; "": not stated
  std::string program, date;                                            // version, and day as 2026-11-24
};

// SHA-256 of manifest.json, without a secret that was published later, and of the files of trials/.
std::string hash_of_records(const std::filesystem::path& folder);

// `details` are kept beside. Throws Error(io).
void write_replays(const std::filesystem::path& folder, const Replays& replays, Json details);

// Nullopt where there is none, or none of these records.
std::optional<Replays> read_replays(const std::filesystem::path& folder);

}  // namespace relign::records
