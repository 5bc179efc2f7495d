#include "gpu/gpu.h"

#include "base/files.h"
#include "base/text.h"
#include "gpu/capture_kernel.h"
#include "gpu/nvrtc.h"

namespace relign::gpu {
namespace {

constexpr int kOldestDriver = 12000;  // the CUDA version it supports: 1000 major + 10 minor

struct Found {
  int device = 0;
  std::string name, architecture;
  int cuda = 0;  // major version that the driver supports
  std::size_t memory_bytes = 0;
};

std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

Found find_gpu(const Driver& driver) {
  int version = 0;
  driver.check(driver.cuDriverGetVersion(&version), "cuDriverGetVersion");
  if (version < kOldestDriver)
    throw Error(ErrorKind::bad_input, "the NVIDIA driver is too old: it supports CUDA " + version_text(version) +
                                          ", the simulator needs " + version_text(kOldestDriver) +
                                          " or later; update the driver");
  const int started = driver.cuInit(0);
  int count = 0;
  if (started == 0) driver.check(driver.cuDeviceGetCount(&count), "cuDeviceGetCount");
  if (started == kNoDevice || (started == 0 && count == 0))
    throw Error(ErrorKind::bad_input, "the NVIDIA driver finds no GPU");
  if (started != 0) throw Error(ErrorKind::bad_input, "the NVIDIA driver does not start: " + driver.text_of(started));
  Found found;
  found.cuda = version / 1000;
  driver.check(driver.cuDeviceGet(&found.device, 0), "cuDeviceGet");
  char name[256] = "";
  driver.check(driver.cuDeviceGetName(name, sizeof name, found.device), "cuDeviceGetName");
  found.name = name;
  int major = 0, minor = 0;
  driver.check(driver.cuDeviceGetAttribute(&major, kComputeCapabilityMajor, found.device), "cuDeviceGetAttribute");
  driver.check(driver.cuDeviceGetAttribute(&minor, kComputeCapabilityMinor, found.device), "cuDeviceGetAttribute");
  found.architecture = "sm_" + std::to_string(major) + std::to_string(minor);
  driver.check(driver.cuDeviceTotalMem(&found.memory_bytes, found.device), "cuDeviceTotalMem");
  return found;
}

}  // namespace

Availability look_for_gpu() {
  try {
    const Driver driver;
    const Found found = find_gpu(driver);
    const std::string gpu =
        found.name + ", " + significant(static_cast<double>(found.memory_bytes) / 1e9) + " GB, " + found.architecture;
    try {
      cached_kernels(found.architecture, cache_folder(), found.cuda);
    } catch (const Error& error) {
      return {false, gpu + ", but " + error.what()};
    }
    return {true, gpu};
  } catch (const Error& error) {
    return {false, error.what()};
  }
}

// Makes the context this thread's for its lifetime, and leaves that of other libraries as it was. If it cannot, the
// calls that follow fail and are reported.
class Gpu::Current {
 public:
  explicit Current(const Gpu& gpu) : driver_(gpu.driver_), pushed_(driver_.cuCtxPushCurrent(gpu.context_) == 0) {}
  ~Current() {
    Handle popped = nullptr;
    if (pushed_) driver_.cuCtxPopCurrent(&popped);
  }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;

 private:
  const Driver& driver_;
  bool pushed_;
};

Buffer::~Buffer() {
  if (address_ == 0) return;
  const Gpu::Current current(*gpu_);
  gpu_->driver().cuMemFree(address_);
}

void Buffer::reserve(std::size_t bytes) {
  if (bytes <= bytes_) return;
  const Gpu::Current current(*gpu_);
  const Driver& driver = gpu_->driver();
  if (address_ != 0) driver.check(driver.cuMemFree(address_), "cuMemFree");
  address_ = 0;
  bytes_ = 0;
  driver.check(driver.cuMemAlloc(&address_, bytes), "cuMemAlloc");
  bytes_ = bytes;
}

void Buffer::upload(const void* from, std::size_t bytes) {
  if (bytes == 0) return;
  reserve(bytes);
  const Gpu::Current current(*gpu_);
  gpu_->driver().check(gpu_->driver().cuMemcpyHtoD(address_, from, bytes), "cuMemcpyHtoD");
}

void Buffer::download(void* to, std::size_t bytes, std::size_t first) const {
  if (bytes == 0) return;
  const Gpu::Current current(*gpu_);
  gpu_->driver().check(gpu_->driver().cuMemcpyDtoH(to, address_ + first, bytes), "cuMemcpyDtoH");
}

Gpu::Gpu() {
  const Found found = find_gpu(driver_);
  name_ = found.name;
  device_ = found.device;
  const std::string kernels = cached_kernels(found.architecture, cache_folder(), found.cuda);
  try {
    driver_.check(driver_.cuDevicePrimaryCtxRetain(&context_, device_), "cuDevicePrimaryCtxRetain");
    const Current current(*this);
    driver_.check(driver_.cuModuleLoadData(&module_, kernels.data()), "cuModuleLoadData");
    for (std::size_t i = 0; i < std::size(kKernels); ++i)
      driver_.check(driver_.cuModuleGetFunction(&kernels_[i], module_, kKernels[i]), "cuModuleGetFunction");
    for (Handle& event : events_) driver_.check(driver_.cuEventCreate(&event, 0), "cuEventCreate");
  } catch (...) {
    close();
    throw;
  }
}

Gpu::~Gpu() { close(); }

void Gpu::close() {
  if (!context_) return;
  {
    const Current current(*this);
    for (Handle event : events_)
      if (event) driver_.cuEventDestroy(event);
    if (module_) driver_.cuModuleUnload(module_);
  }
  driver_.cuDevicePrimaryCtxRelease(device_);
}

void Gpu::launch(Kernel kernel, std::size_t blocks, void** arguments) {
  if (blocks == 0) return;
  const Current current(*this);
  driver_.check(driver_.cuLaunchKernel(kernels_[static_cast<std::size_t>(kernel)], static_cast<unsigned>(blocks), 1, 1,
                                       kTileThreads, 1, 1, 0, nullptr, arguments, nullptr),
                "cuLaunchKernel");
}

void Gpu::wait() const {
  const Current current(*this);
  driver_.check(driver_.cuCtxSynchronize(), "cuCtxSynchronize");
}

void Gpu::start_clock() {
  const Current current(*this);
  driver_.check(driver_.cuEventRecord(events_[0], nullptr), "cuEventRecord");
}

double Gpu::stop_clock() {
  const Current current(*this);
  driver_.check(driver_.cuEventRecord(events_[1], nullptr), "cuEventRecord");
  driver_.check(driver_.cuEventSynchronize(events_[1]), "cuEventSynchronize");
  float milliseconds = 0;
  driver_.check(driver_.cuEventElapsedTime(&milliseconds, events_[0], events_[1]), "cuEventElapsedTime");
  return static_cast<double>(milliseconds);
}

}  // namespace relign::gpu
