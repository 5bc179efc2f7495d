// Content hashes. SHA-256, so that anyone can check them with sha256sum or hashlib.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace relign {

// 64 hex digits.
std::string sha256_hex(std::string_view content);
std::string sha256_file(const std::filesystem::path& path);  // throws Error(io)

// The first 16 hex digits: trial ids, cache names.
std::string short_hash(std::string_view content);

}  // namespace relign
