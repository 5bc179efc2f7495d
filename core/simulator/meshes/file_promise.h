// What a mesh file says about its own length. assimp takes the rest of many truncated files for the whole, or reads
// what lies behind their end.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace relign::meshes {

struct FilePromise {
  std::optional<std::uint64_t> faces;
};

// Both throw Error(bad_input) that begins with `file` when the content is none of this kind, or too short for what its
// header tells of.
FilePromise promise_of_ply(const std::string& file, const std::string& content);
FilePromise promise_of_stl(const std::string& file, const std::string& content);

}  // namespace relign::meshes
