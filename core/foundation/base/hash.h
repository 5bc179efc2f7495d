// Content hashes. SHA-256, so that anyone can check them with sha256sum or hashlib.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace relign {

// 64 hex digits.
std::string sha256_hex(std::string_view content);
std::string sha256_file(const std::filesystem::path& path);  // throws Error(io)

// SHA-256 of a text that comes in parts.
class Sha256 {
 public:
  Sha256();
  ~Sha256();
  void begin();  // forgets what was added
  void add(std::string_view part);
  std::string hex();  // 64 hex digits; then begin() or nothing

 private:
  struct Context;
  std::unique_ptr<Context> context_;
};

// The first 16 hex digits: trial ids, cache names.
std::string short_hash(std::string_view content);

}  // namespace relign
