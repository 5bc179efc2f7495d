// An NVIDIA GPU with the simulator's kernels on it: memory, launches, times.
#pragma once

#include <cstddef>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "gpu/driver.h"

namespace relign::gpu {

// For `doctor`: the GPU that the kernels run on, or in one sentence why there is none.
struct Availability {
  bool usable = false;
  std::string sentence;
};
Availability look_for_gpu();

class Gpu;

// Memory of a GPU, which must outlive it.
class Buffer {
 public:
  explicit Buffer(const Gpu& gpu) : gpu_(&gpu) {}
  ~Buffer();
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  Address address() const { return address_; }
  template <class T>
  T* as() const {
    return reinterpret_cast<T*>(address_);
  }
  // Makes it at least this large; what it held may be lost.
  void reserve(std::size_t bytes);
  void upload(const void* from, std::size_t bytes);
  void download(void* to, std::size_t bytes, std::size_t first = 0) const;  // first: byte

 private:
  const Gpu* gpu_;
  Address address_ = 0;
  std::size_t bytes_ = 0;
};

// The first GPU, in its primary context, which libraries such as PyTorch share. From any thread; one at a time. Throws
// Error(bad_input) with look_for_gpu()'s sentence.
class Gpu {
 public:
  Gpu();
  ~Gpu();
  Gpu(const Gpu&) = delete;
  Gpu& operator=(const Gpu&) = delete;

  const std::string& name() const { return name_; }
  const Driver& driver() const { return driver_; }
  // Of tile_kernel.h, capture_kernel.h and ghost_kernel.h.
  enum class Kernel {
    request,
    fill,
    corners,
    probes,
    blur,
    see,
    tiles,
    check,
    clear,
    capture,
    electronics,
    read_out,
    squares,
    mse,
    ghosts
  };
  static constexpr const char* kKernels[] = {
      "relign_request",     "relign_fill",     "relign_corners", "relign_probes", "relign_blur",
      "relign_see",         "relign_tiles",    "relign_check",   "relign_clear",  "relign_capture",
      "relign_electronics", "relign_read_out", "relign_squares", "relign_mse",    "relign_ghosts"};
  // So many blocks of kTileThreads threads. Does not wait.
  void launch(Kernel kernel, std::size_t blocks, void** arguments);
  // Until all work in the context is done, that of other libraries too.
  void wait() const;
  // Milliseconds of GPU time between the two calls.
  void start_clock();
  double stop_clock();

 private:
  friend class Buffer;
  class Current;
  void close();

  Driver driver_;
  std::string name_;
  int device_ = 0;
  Handle context_ = nullptr, module_ = nullptr, kernels_[std::size(kKernels)] = {}, events_[2] = {};
};

}  // namespace relign::gpu
