// The functions of NVIDIA's driver (libcuda) that the simulator calls, opened at run time: nothing of CUDA is needed to
// build this program.
#pragma once

#include <cstddef>

#include "gpu/shared_library.h"

namespace relign::gpu {

// Declared as in cuda.h of CUDA 12 and 13; CUresult and CUdevice are int.
using Address = unsigned long long;  // CUdeviceptr
using Handle = void*;                // CUcontext, CUmodule, CUfunction, CUevent

struct Driver {
  // Throws Error(bad_input) without a driver that has all these functions.
  Driver();

  SharedLibrary library;
  int (*cuInit)(unsigned) = nullptr;
  int (*cuDriverGetVersion)(int*) = nullptr;
  int (*cuGetErrorString)(int, const char**) = nullptr;
  int (*cuDeviceGetCount)(int*) = nullptr;
  int (*cuDeviceGet)(int*, int) = nullptr;
  int (*cuDeviceGetName)(char*, int, int) = nullptr;
  int (*cuDeviceGetAttribute)(int*, int, int) = nullptr;
  int (*cuDeviceTotalMem)(std::size_t*, int) = nullptr;
  int (*cuDevicePrimaryCtxRetain)(Handle*, int) = nullptr;
  int (*cuDevicePrimaryCtxRelease)(int) = nullptr;
  int (*cuCtxPushCurrent)(Handle) = nullptr;
  int (*cuCtxPopCurrent)(Handle*) = nullptr;
  int (*cuCtxSynchronize)() = nullptr;
  int (*cuModuleLoadData)(Handle*, const void*) = nullptr;
  int (*cuModuleUnload)(Handle) = nullptr;
  int (*cuModuleGetFunction)(Handle*, Handle, const char*) = nullptr;
  int (*cuMemAlloc)(Address*, std::size_t) = nullptr;
  int (*cuMemFree)(Address) = nullptr;
  int (*cuMemcpyHtoD)(Address, const void*, std::size_t) = nullptr;
  int (*cuMemcpyDtoH)(void*, Address, std::size_t) = nullptr;
  int (*cuLaunchKernel)(Handle, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, unsigned, Handle, void**,
                        void**) = nullptr;
  int (*cuEventCreate)(Handle*, unsigned) = nullptr;
  int (*cuEventRecord)(Handle, Handle) = nullptr;
  int (*cuEventSynchronize)(Handle) = nullptr;
  int (*cuEventElapsedTime)(float*, Handle, Handle) = nullptr;
  int (*cuEventDestroy)(Handle) = nullptr;

  // "out of memory", or the number.
  std::string text_of(int result) const;
  // Throws Error if a call failed: bad_input for too little memory, else internal.
  void check(int result, const char* call) const;
};

constexpr int kOutOfMemory = 2, kNoDevice = 100;                           // CUresult
constexpr int kComputeCapabilityMajor = 75, kComputeCapabilityMinor = 76;  // CUdevice_attribute

}  // namespace relign::gpu
