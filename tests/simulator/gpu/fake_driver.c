/* A libcuda whose answers the environment chooses, to test what is said about drivers and GPUs. It runs nothing. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define EXPORT __attribute__((visibility("default")))

static int chosen(const char* name, int otherwise) {
  const char* text = getenv(name);
  return text ? atoi(text) : otherwise;
}

EXPORT int cuInit(unsigned flags) {
  (void)flags;
  return chosen("FAKE_CUDA_INIT", 0);
}
EXPORT int cuDriverGetVersion(int* version) {
  *version = chosen("FAKE_CUDA_VERSION", 13000);
  return 0;
}
EXPORT int cuGetErrorString(int result, const char** text) {
  *text = result == 999 ? "unknown error" : NULL;
  return *text ? 0 : 1;
}
EXPORT int cuDeviceGetCount(int* count) {
  *count = chosen("FAKE_CUDA_GPUS", 1);
  return 0;
}
EXPORT int cuDeviceGet(int* device, int number) {
  *device = number;
  return 0;
}
EXPORT int cuDeviceGetName(char* name, int length, int device) {
  (void)device;
  strncpy(name, "Made-up GPU", (size_t)length);
  return 0;
}
EXPORT int cuDeviceGetAttribute(int* value, int attribute, int device) {
  (void)device;
  *value = attribute == 75 ? 9 : 0;
  return 0;
}
EXPORT int cuDeviceTotalMem_v2(size_t* bytes, int device) {
  (void)device;
  *bytes = 80000000000u;
  return 0;
}

#define FAILS(name) \
  EXPORT int name(void) { return 999; }
FAILS(cuDevicePrimaryCtxRetain)
FAILS(cuDevicePrimaryCtxRelease_v2)
FAILS(cuCtxPushCurrent_v2)
FAILS(cuCtxPopCurrent_v2)
FAILS(cuCtxSynchronize)
FAILS(cuModuleLoadData)
FAILS(cuModuleUnload)
FAILS(cuModuleGetFunction)
FAILS(cuMemAlloc_v2)
FAILS(cuMemFree_v2)
FAILS(cuMemcpyHtoD_v2)
FAILS(cuMemcpyDtoH_v2)
FAILS(cuLaunchKernel)
FAILS(cuEventCreate)
FAILS(cuEventRecord)
FAILS(cuEventSynchronize)
FAILS(cuEventElapsedTime)
FAILS(cuEventDestroy_v2)
