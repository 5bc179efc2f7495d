// A libcuda whose GPU is this process, and its NVRTC: the whole path to images on a GPU, without one. Kernels are plain
// loops over the threads' functions. Mistakes that a GPU punishes end here, too: its memory can be accessed only inside
// kernels and copies, ends at an inaccessible page, and is filled with garbage first; functions fail without a current
// context; copies outside an allocation fail; what was not freed is an abort.
//
// Environment: EMULATED_CUDA_MEMORY, bytes that can be allocated; EMULATED_CUDA_FAILS, the name of a function that
// fails; EMULATED_NVRTC_MAJOR, version of the compiler.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "gpu/ghost_kernel.h"
#include "gpu/gpu.h"

#define EXPORT extern "C" __attribute__((visibility("default")))

namespace {

using namespace relign;
using Address = unsigned long long;
using Handle = void*;
using Kernel = gpu::Gpu::Kernel;
constexpr int kInvalidValue = 1, kOutOfMemory = 2, kInvalidContext = 201, kLaunchFailed = 719;
constexpr char kCompiled[] = "kernels of the emulated GPU";

struct Allocation {
  char* pages = nullptr;
  std::size_t accessible = 0;  // bytes of pages before the inaccessible one
  std::size_t bytes = 0;
};

std::recursive_mutex mutex;
std::map<Address, Allocation> allocations;
int kernels[std::size(gpu::Gpu::kKernels)] = {};  // one for each
int context = 0, users = 0, launches = 0;
thread_local int current = 0;  // depth of the thread's stack of contexts

void protect(int access) {
  for (const auto& [address, allocation] : allocations) ::mprotect(allocation.pages, allocation.accessible, access);
}

// Access to all memory of the GPU.
class Access {
 public:
  Access() { protect(PROT_READ | PROT_WRITE); }
  ~Access() { protect(PROT_NONE); }
  Access(const Access&) = delete;
  Access& operator=(const Access&) = delete;

 private:
  const std::lock_guard<std::recursive_mutex> lock_{mutex};
};

bool chosen_to_fail(const char* function) {
  const char* name = std::getenv("EMULATED_CUDA_FAILS");
  return name != nullptr && std::strcmp(name, function) == 0;
}

// 0 if a function that needs a context may run.
int problem(const char* function) {
  if (chosen_to_fail(function)) return kLaunchFailed;
  return current > 0 ? 0 : kInvalidContext;
}

bool inside(Address address, std::size_t bytes) {
  auto found = allocations.upper_bound(address);
  if (found == allocations.begin()) return false;
  --found;
  return address + bytes <= found->first + found->second.bytes;
}

void capture(const gpu::Batch& batch, const gpu::TileJob& tile, float* images) {
  for (std::int32_t pixel = 0; pixel < tile.lit_pixels; ++pixel) gpu::capture_pixel(batch, tile, pixel, images);
}

void clear(const gpu::Batch& batch, const gpu::ImageJob& image, float* images) {
  std::fill_n(gpu::image_at(batch, image, images), batch.image_pixels, 0.0F);
}

double squares(const gpu::Batch& batch, const gpu::ImageJob& image, float* images) {
  const float* const pixels = gpu::image_at(batch, image, images);
  double sums[gpu::kSquareSums] = {};
  for (std::int32_t i = 0; i < batch.image_pixels; ++i)
    sums[i % gpu::kSquareSums] += gpu::squared_difference(pixels[i], batch.reference_mean[i]);
  return gpu::sum_of_squares(sums);
}

void mse(const gpu::Batch& batch, const gpu::TileJob& tile, imaging::MseSum* sum) {
  *sum = {};
  for (std::int32_t pixel = 0; pixel < tile.pixels; ++pixel) *sum += gpu::mse_pixel(batch, tile, pixel);
}

// Calls body(i) for each i below count that a thread of these blocks has.
template <class Body>
void each_thread(unsigned blocks, std::int32_t count, const Body& body) {
  for (unsigned i = 0; i < blocks * unsigned{gpu::kTileThreads}; ++i)
    if (static_cast<std::int32_t>(i) < count) body(static_cast<std::int32_t>(i));
}

void fit(Kernel kernel, const gpu::FitBatch& batch, unsigned blocks) {
  const std::int32_t corners = batch.image_count * batch.grid.corners(), tiles = batch.image_count * batch.grid.tiles();
  optics::RegionSearch work;
  switch (kernel) {
    case Kernel::request:
      return each_thread(blocks, corners, [&](std::int32_t i) { gpu::request_regions(batch, i); });
    case Kernel::fill:
      for (std::int32_t i = 0; i < batch.missing[0]; ++i) gpu::fill_region(optics::OneThread(), batch, i, work);
      return;
    case Kernel::corners:
      return each_thread(blocks, corners, [&](std::int32_t i) { gpu::fit_corner(batch, i); });
    case Kernel::probes:
      return each_thread(blocks, corners * imaging::kProbes, [&](std::int32_t i) { gpu::trace_probe(batch, i); });
    case Kernel::blur:
      return each_thread(blocks, corners, [&](std::int32_t i) { gpu::see_blur(batch, i); });
    case Kernel::see:
      return each_thread(blocks, tiles, [&](std::int32_t i) { gpu::see_emitter(batch, i); });
    default:
      return each_thread(blocks, tiles, [&](std::int32_t i) { gpu::fit_tile(batch, i); });
  }
}

void render(Kernel kernel, void** arguments, unsigned blocks) {
  const auto& batch = *static_cast<const gpu::Batch*>(arguments[0]);
  void* const out = *static_cast<void**>(arguments[1]);
  auto* const images = static_cast<float*>(out);
  if (kernel == Kernel::electronics) {
    const auto count = static_cast<std::int32_t>(*static_cast<std::int64_t*>(arguments[3]));
    return each_thread(blocks, count, [&](std::int32_t i) {
      gpu::read_out_pixel(batch, *static_cast<gpu::ErrorBatch*>(arguments[2]), i, images);
    });
  }
  if (kernel == Kernel::ghosts) {
    const auto& ghosts = *static_cast<const gpu::GhostBatch*>(arguments[2]);
    const auto of_box = static_cast<unsigned>(ghosts.blocks_of_box);
    for (unsigned block = 0; block < blocks; ++block)
      for (std::int32_t thread = 0; thread < gpu::kTileThreads; ++thread) {
        const gpu::GhostBoxJob& box = ghosts.boxes[block / of_box];
        const std::int32_t pixel = static_cast<std::int32_t>(block % of_box) * gpu::kTileThreads + thread;
        if (pixel < box.pixels) gpu::ghost_pixel(batch, ghosts, box, pixel, images);
      }
    return;
  }
  for (unsigned block = 0; block < blocks; ++block) switch (kernel) {
      case Kernel::clear:
        clear(batch, batch.images[block], images);
        break;
      case Kernel::capture:
        capture(batch, batch.tiles[block], images);
        break;
      case Kernel::read_out:
        gpu::read_out_image(optics::OneThread(), batch, *static_cast<gpu::ErrorBatch*>(arguments[2]),
                            batch.images[block], images);
        break;
      case Kernel::squares:
        static_cast<double*>(*static_cast<void**>(arguments[2]))[block] = squares(batch, batch.images[block], images);
        break;
      default:
        mse(batch, batch.tiles[block], static_cast<imaging::MseSum*>(out) + block);
    }
}

}  // namespace

EXPORT int cuInit(unsigned) { return chosen_to_fail("cuInit") ? kLaunchFailed : 0; }
EXPORT int cuDriverGetVersion(int* version) {
  *version = 12000;
  return 0;
}
EXPORT int cuGetErrorString(int result, const char** text) {
  *text = result == kInvalidValue     ? "invalid argument"
          : result == kInvalidContext ? "invalid device context"
                                      : "unspecified launch failure";
  return 0;
}
EXPORT int cuDeviceGetCount(int* count) {
  *count = 1;
  return 0;
}
EXPORT int cuDeviceGet(int* device, int number) {
  *device = number;
  return number == 0 ? 0 : kInvalidValue;
}
EXPORT int cuDeviceGetName(char* name, int length, int) {
  std::snprintf(name, static_cast<std::size_t>(length), "Emulated GPU");
  return 0;
}
// Compute capability 0.0, so that no kept kernels of a GPU are taken for this one's.
EXPORT int cuDeviceGetAttribute(int* value, int, int) {
  *value = 0;
  return 0;
}
EXPORT int cuDeviceTotalMem_v2(std::size_t* bytes, int) {
  *bytes = 1000000000;
  return 0;
}

EXPORT int cuDevicePrimaryCtxRetain(Handle* made, int) {
  if (chosen_to_fail("cuDevicePrimaryCtxRetain")) return kLaunchFailed;
  ++users;
  *made = &context;
  return 0;
}
EXPORT int cuDevicePrimaryCtxRelease_v2(int) {
  if (--users > 0 || allocations.empty()) return 0;
  std::fprintf(stderr, "emulated driver: %zu allocations were not freed\n", allocations.size());
  std::abort();
}
EXPORT int cuCtxPushCurrent_v2(Handle pushed) {
  if (pushed != &context || users == 0) return kInvalidContext;
  ++current;
  return 0;
}
EXPORT int cuCtxPopCurrent_v2(Handle* popped) {
  if (current == 0) return kInvalidContext;
  --current;
  *popped = &context;
  return 0;
}
EXPORT int cuCtxSynchronize() { return problem("cuCtxSynchronize"); }

EXPORT int cuModuleLoadData(Handle* module, const void* image) {
  if (const int result = problem("cuModuleLoadData")) return result;
  *module = &kernels;
  return std::strcmp(static_cast<const char*>(image), kCompiled) == 0 ? 0 : kInvalidValue;
}
EXPORT int cuModuleUnload(Handle module) { return module == &kernels ? 0 : kInvalidValue; }
EXPORT int cuModuleGetFunction(Handle* function, Handle, const char* name) {
  for (std::size_t i = 0; i < std::size(kernels); ++i)
    if (std::strcmp(name, gpu::Gpu::kKernels[i]) == 0) *function = &kernels[i];
  return *function != nullptr ? 0 : kInvalidValue;
}

EXPORT int cuMemAlloc_v2(Address* address, std::size_t bytes) {
  if (const int result = problem("cuMemAlloc")) return result;
  if (bytes == 0) return kInvalidValue;
  const std::lock_guard<std::recursive_mutex> lock(mutex);
  std::size_t held = bytes;
  for (const auto& [other, allocation] : allocations) held += allocation.bytes;
  const char* limit = std::getenv("EMULATED_CUDA_MEMORY");
  if (limit != nullptr && held > std::strtoull(limit, nullptr, 10)) return kOutOfMemory;
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  Allocation made;
  made.bytes = bytes;
  made.accessible = (bytes + page - 1) / page * page;
  void* pages = ::mmap(nullptr, made.accessible + page, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED) return kOutOfMemory;
  made.pages = static_cast<char*>(pages);
  constexpr std::size_t kAlignment = 16;  // the end of the allocation is that of the page
  char* const first = made.pages + (made.accessible - bytes) / kAlignment * kAlignment;
  *address = reinterpret_cast<Address>(first);
  allocations[*address] = made;
  const Access access;
  std::memset(made.pages, 0xA5, made.accessible);
  return 0;
}
EXPORT int cuMemFree_v2(Address address) {
  if (const int result = problem("cuMemFree")) return result;
  const std::lock_guard<std::recursive_mutex> lock(mutex);
  const auto found = allocations.find(address);
  if (found == allocations.end()) return kInvalidValue;
  ::munmap(found->second.pages, found->second.accessible + static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)));
  allocations.erase(found);
  return 0;
}
EXPORT int cuMemcpyHtoD_v2(Address to, const void* from, std::size_t bytes) {
  if (const int result = problem("cuMemcpyHtoD")) return result;
  const Access access;
  if (!inside(to, bytes)) return kInvalidValue;
  std::memcpy(reinterpret_cast<void*>(to), from, bytes);
  return 0;
}
EXPORT int cuMemcpyDtoH_v2(void* to, Address from, std::size_t bytes) {
  if (const int result = problem("cuMemcpyDtoH")) return result;
  const Access access;
  if (!inside(from, bytes)) return kInvalidValue;
  std::memcpy(to, reinterpret_cast<const void*>(from), bytes);
  return 0;
}
EXPORT int cuLaunchKernel(Handle function, unsigned blocks, unsigned y, unsigned z, unsigned threads, unsigned,
                          unsigned, unsigned, Handle, void** arguments, void**) {
  if (const int result = problem("cuLaunchKernel")) return result;
  if (blocks == 0 || y != 1 || z != 1 || threads != unsigned{gpu::kTileThreads}) return kInvalidValue;
  const Access access;
  ++launches;
  const auto kernel = static_cast<Kernel>(static_cast<int*>(function) - kernels);
  if (kernel == Kernel::check) {
    const auto& checks = *static_cast<const gpu::CheckBatch*>(arguments[1]);
    const auto& batch = *static_cast<const gpu::FitBatch*>(arguments[0]);
    each_thread(blocks, checks.image_count * checks.pixel_count * checks.rays,
                [&](std::int32_t i) { gpu::check_ray(batch, checks, i); });
  } else if (kernel <= Kernel::tiles)
    fit(kernel, *static_cast<const gpu::FitBatch*>(arguments[0]), blocks);
  else
    render(kernel, arguments, blocks);
  return 0;
}

EXPORT int cuEventCreate(Handle* event, unsigned) {
  *event = &context;
  return problem("cuEventCreate");
}
EXPORT int cuEventRecord(Handle, Handle) { return problem("cuEventRecord"); }
EXPORT int cuEventSynchronize(Handle) { return problem("cuEventSynchronize"); }
EXPORT int cuEventElapsedTime(float* milliseconds, Handle, Handle) {
  *milliseconds = 1;
  return problem("cuEventElapsedTime");
}
EXPORT int cuEventDestroy_v2(Handle) { return problem("cuEventDestroy"); }

EXPORT int nvrtcVersion(int* major, int* minor) {
  const char* chosen = std::getenv("EMULATED_NVRTC_MAJOR");
  *major = chosen != nullptr ? std::atoi(chosen) : 12;
  *minor = 0;
  return 0;
}
EXPORT const char* nvrtcGetErrorString(int) { return "compilation error"; }
EXPORT int nvrtcCreateProgram(void** program, const char*, const char*, int, const char* const*, const char* const*) {
  *program = &kernels;
  return 0;
}
EXPORT int nvrtcDestroyProgram(void**) { return 0; }
EXPORT int nvrtcCompileProgram(void*, int, const char* const*) { return 0; }
EXPORT int nvrtcGetProgramLogSize(void*, std::size_t* bytes) {
  *bytes = 1;
  return 0;
}
EXPORT int nvrtcGetProgramLog(void*, char* text) {
  *text = '\0';
  return 0;
}
EXPORT int nvrtcGetPTXSize(void*, std::size_t* bytes) {
  *bytes = sizeof kCompiled;
  return 0;
}
EXPORT int nvrtcGetPTX(void*, char* text) {
  std::memcpy(text, kCompiled, sizeof kCompiled);
  return 0;
}
EXPORT int nvrtcGetCUBINSize(void* program, std::size_t* bytes) { return nvrtcGetPTXSize(program, bytes); }
EXPORT int nvrtcGetCUBIN(void* program, char* text) { return nvrtcGetPTX(program, text); }

// For tests: what is allocated, and how many kernels were launched.
EXPORT std::size_t emulated_cuda_allocations() { return allocations.size(); }
EXPORT int emulated_cuda_launches() { return launches; }
