// Compiles the kernels with NVIDIA's run-time compiler NVRTC, which is opened at run time: from the CUDA toolkit, from
// the Python package nvidia-cuda-nvrtc, or from the path in RELIGN_LIBNVRTC.
#pragma once

#include <filesystem>
#include <string>

namespace relign::gpu {

// Options of every compilation: arithmetic as IEEE 754 says and no fusing, so that results have the CPU's bits.
inline constexpr const char* kCompileOptions[] = {"--std=c++20",     "--device-as-default-execution-space",
                                                  "--fmad=false",    "--ftz=false",
                                                  "--prec-div=true", "--prec-sqrt=true"};

// Why NVRTC cannot be used, or empty.
std::string nvrtc_problem();

inline constexpr int kLatestCuda = 13;  // major version

// Machine code for "sm_90", PTX for "compute_90". latest: major version of CUDA that the driver supports, since it runs
// no code of later compilers. Throws Error(bad_input) with the compiler's first message.
std::string compile_kernels(const std::string& architecture, int latest = kLatestCuda);

// The same, kept in a file of `cache` that is named after sources, options, architecture and `latest`; empty: not kept.
std::string cached_kernels(const std::string& architecture, const std::filesystem::path& cache,
                           int latest = kLatestCuda);

}  // namespace relign::gpu
