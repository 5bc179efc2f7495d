// The rounds of Philox4x32-10 (Salmon, Moraes, Dror, Shaw, SC 2011) on plain words, and how functions are marked that
// g++, clang and NVIDIA's NVRTC all compile.
//
// What it is for: kernels that are compiled several times, for instruction sets and for GPUs. Use philox4x32 and Random
// of random.hpp elsewhere.
#ifndef RELIGN_PHILOX_HPP
#define RELIGN_PHILOX_HPP

#include <cstdint>

// Always inlined, so that no linker picks a copy that was compiled for other instructions.
#if defined(__CUDACC_RTC__)
#define RELIGN_DEVICE __device__ __forceinline__
#else
#define RELIGN_DEVICE inline __attribute__((always_inline))
#endif

namespace relign {

// 128 random bits, in place of the counter's four words.
RELIGN_DEVICE void philox_rounds(std::uint32_t (&words)[4], std::uint32_t key0, std::uint32_t key1) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t product0 = std::uint64_t{0xD2511F53U} * words[0];
    const std::uint64_t product1 = std::uint64_t{0xCD9E8D57U} * words[2];
    words[0] = static_cast<std::uint32_t>(product1 >> 32) ^ words[1] ^ key0;
    words[1] = static_cast<std::uint32_t>(product1);
    words[2] = static_cast<std::uint32_t>(product0 >> 32) ^ words[3] ^ key1;
    words[3] = static_cast<std::uint32_t>(product0);
    key0 += 0x9E3779B9U;
    key1 += 0xBB67AE85U;
  }
}

}  // namespace relign

#endif  // RELIGN_PHILOX_HPP
