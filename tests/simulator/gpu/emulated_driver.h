// Chooses the driver of a test by the environment: the emulated one (emulated_driver.cpp), or another.
#pragma once

#include <dlfcn.h>

#include <cstddef>
#include <cstdlib>
#include <initializer_list>
#include <utility>
#include <vector>

namespace relign::gpu {

// Environment variables for the length of a test.
class With {
 public:
  With(std::initializer_list<std::pair<const char*, const char*>> values) {
    for (const auto& [name, value] : values) {
      names_.push_back(name);
      ::setenv(name, value, 1);
    }
  }
  ~With() {
    for (const char* name : names_) ::unsetenv(name);
  }
  With(const With&) = delete;
  With& operator=(const With&) = delete;

 private:
  std::vector<const char*> names_;
};

class EmulatedGpu {
 public:
  // Of what is in the GPU's memory, and how many kernels were launched by this process.
  std::size_t allocations() const { return function<std::size_t>("emulated_cuda_allocations")(); }
  int launches() const { return function<int>("emulated_cuda_launches")(); }

 private:
  template <class Result>
  Result (*function(const char* name) const)() {
    return reinterpret_cast<Result (*)()>(::dlsym(::dlopen(RELIGN_EMULATED_DRIVER, RTLD_NOW | RTLD_LOCAL), name));
  }

  With environment_{{"RELIGN_LIBCUDA", RELIGN_EMULATED_DRIVER}, {"RELIGN_LIBNVRTC", RELIGN_EMULATED_DRIVER}};
};

}  // namespace relign::gpu
