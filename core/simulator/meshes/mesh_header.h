// Checks mesh files against their headers before assimp reads them: assimp accepts many truncated files as complete, or
// reads beyond their end.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace relign::meshes {

struct HeaderCounts {
  std::optional<std::uint64_t> faces;  // empty if the format does not state it
};

// Both throw Error(bad_input) that begins with `file` if the content has another format, or is too short for the counts
// in its header.
HeaderCounts check_ply_header(const std::string& file, const std::string& content);
HeaderCounts check_stl_header(const std::string& file, const std::string& content);

}  // namespace relign::meshes
