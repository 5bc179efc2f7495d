#include "base/seeds.h"

#include <relign/random.hpp>

namespace relign {
namespace {

enum class Purpose : std::uint32_t {
  instance = 0x494e5354,
  batch = 0x42415443,
  frame = 0x4652414d,
  algorithm = 0x414c474f
};

std::uint64_t mix(std::uint64_t key, std::uint64_t value, std::uint32_t detail, Purpose purpose) {
  const auto block = philox4x32({static_cast<std::uint32_t>(value), static_cast<std::uint32_t>(value >> 32), detail,
                                 static_cast<std::uint32_t>(purpose)},
                                {static_cast<std::uint32_t>(key), static_cast<std::uint32_t>(key >> 32)});
  return static_cast<std::uint64_t>(block[0]) << 32 | block[1];
}

}  // namespace

std::uint64_t instance_seed(std::uint64_t suite_seed, SeedDomain domain, std::uint64_t number) {
  return mix(suite_seed, number, static_cast<std::uint32_t>(domain), Purpose::instance);
}

std::uint64_t batch_seed(std::uint64_t suite_seed, SeedDomain domain, std::uint64_t number) {
  return mix(suite_seed, number, static_cast<std::uint32_t>(domain), Purpose::batch);
}

std::uint64_t frame_seed(std::uint64_t instance_seed, std::uint32_t step, FrameStream stream) {
  return mix(instance_seed, step, static_cast<std::uint32_t>(stream), Purpose::frame);
}

std::uint64_t algorithm_seed(std::uint64_t suite_seed, std::string_view label, std::uint64_t number) {
  // FNV-1a hashes the label; Philox mixes the bits.
  std::uint64_t folded = 0xcbf29ce484222325u;
  for (const char letter : label) folded = (folded ^ static_cast<unsigned char>(letter)) * 0x100000001b3u;
  return mix(mix(suite_seed, folded, 0, Purpose::algorithm), number, 1, Purpose::algorithm);
}

}  // namespace relign
