#include "gpu/driver.h"

#include <cstdlib>

namespace relign::gpu {

SharedLibrary::SharedLibrary(const char* chosen, const std::vector<std::string>& names) {
  const char* const only = std::getenv(chosen);
  for (const std::string& name : only&&* only ? std::vector<std::string>{only} : names) {
    name_ = name;
    handle_ = ::dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle_) return;
    if (problem_.empty()) problem_ = ::dlerror();
  }
}

Driver::Driver() : library("RELIGN_LIBCUDA", {"libcuda.so.1"}) {
  if (!library.is_open()) throw Error(ErrorKind::bad_input, "no NVIDIA driver: " + library.problem());
  try {
    library.find(cuInit, "cuInit");
    library.find(cuDriverGetVersion, "cuDriverGetVersion");
    library.find(cuGetErrorString, "cuGetErrorString");
    library.find(cuDeviceGetCount, "cuDeviceGetCount");
    library.find(cuDeviceGet, "cuDeviceGet");
    library.find(cuDeviceGetName, "cuDeviceGetName");
    library.find(cuDeviceGetAttribute, "cuDeviceGetAttribute");
    library.find(cuDeviceTotalMem, "cuDeviceTotalMem_v2");
    library.find(cuDevicePrimaryCtxRetain, "cuDevicePrimaryCtxRetain");
    library.find(cuDevicePrimaryCtxRelease, "cuDevicePrimaryCtxRelease_v2");
    library.find(cuCtxPushCurrent, "cuCtxPushCurrent_v2");
    library.find(cuCtxPopCurrent, "cuCtxPopCurrent_v2");
    library.find(cuCtxSynchronize, "cuCtxSynchronize");
    library.find(cuModuleLoadData, "cuModuleLoadData");
    library.find(cuModuleUnload, "cuModuleUnload");
    library.find(cuModuleGetFunction, "cuModuleGetFunction");
    library.find(cuMemAlloc, "cuMemAlloc_v2");
    library.find(cuMemFree, "cuMemFree_v2");
    library.find(cuMemcpyHtoD, "cuMemcpyHtoD_v2");
    library.find(cuMemcpyDtoH, "cuMemcpyDtoH_v2");
    library.find(cuLaunchKernel, "cuLaunchKernel");
    library.find(cuEventCreate, "cuEventCreate");
    library.find(cuEventRecord, "cuEventRecord");
    library.find(cuEventSynchronize, "cuEventSynchronize");
    library.find(cuEventElapsedTime, "cuEventElapsedTime");
    library.find(cuEventDestroy, "cuEventDestroy_v2");
  } catch (const Error& error) {
    throw Error(ErrorKind::bad_input, std::string("the NVIDIA driver is too old: ") + error.what());
  }
}

std::string Driver::text_of(int result) const {
  const char* text = nullptr;
  if (cuGetErrorString(result, &text) != 0 || text == nullptr) return "error " + std::to_string(result);
  return text;
}

void Driver::check(int result, const char* call) const {
  if (result == 0) return;
  if (result == kOutOfMemory)
    throw Error(ErrorKind::bad_input,
                std::string("the GPU has too little memory (") + call + "); use fewer images per batch");
  throw Error(ErrorKind::internal, std::string("the GPU failed: ") + call + ": " + text_of(result));
}

}  // namespace relign::gpu
