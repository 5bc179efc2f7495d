// What the parts of relign-bench-gpu share: sizes, and how times are taken.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <vector>

namespace relign::gpu_perf {

struct Sizes {
  std::size_t images = 64;     // that are compared with the CPU's
  std::size_t captures = 512;  // of each sample of a distribution
  std::size_t batch = 1024;    // images of a batch that is timed
  int rounds = 15;             // calls whose median is a time
  int pixels = 0;              // columns of images; 0: the scene file's
};

double seconds_of(const auto& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Of what body() returns, in some calls.
double median_of(int rounds, const auto& body) {
  std::vector<double> values;
  for (int i = 0; i < rounds; ++i) values.push_back(body());
  std::nth_element(values.begin(), values.begin() + rounds / 2, values.end());
  return values[static_cast<std::size_t>(rounds / 2)];
}

// Steps of the environment on a GPU, resets and noise-free RMSE included, without Python. plugins: folder with those of
// scene and noise level. Throws Error.
void print_environment(const std::filesystem::path& plugins, const Sizes& sizes);

}  // namespace relign::gpu_perf
