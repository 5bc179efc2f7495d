#include "gpu/nvrtc.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include "base/files.h"
#include "base/hash.h"
#include "gpu/kernel_sources.h"
#include "gpu/shared_library.h"

namespace relign::gpu {
namespace {

constexpr const char* kProgram = "#include \"gpu/ghost_kernel.h\"\n";

// Declared as in nvrtc.h of CUDA 12 and 13; nvrtcResult is int.
struct Nvrtc {
  explicit Nvrtc(int latest) : library("RELIGN_LIBNVRTC", names(latest)) {
    if (!library.is_open())
      throw Error(ErrorKind::bad_input,
                  "NVIDIA's compiler NVRTC was not found (" + library.problem() +
                      "); install the CUDA toolkit or the Python package nvidia-cuda-nvrtc, and set RELIGN_LIBNVRTC to "
                      "the path of its libnvrtc.so");
    library.find(version, "nvrtcVersion");
    library.find(error_text, "nvrtcGetErrorString");
    library.find(create, "nvrtcCreateProgram");
    library.find(destroy, "nvrtcDestroyProgram");
    library.find(compile, "nvrtcCompileProgram");
    library.find(log_size, "nvrtcGetProgramLogSize");
    library.find(log, "nvrtcGetProgramLog");
    library.find(ptx_size, "nvrtcGetPTXSize");
    library.find(ptx, "nvrtcGetPTX");
    library.find(code_size, "nvrtcGetCUBINSize");
    library.find(code, "nvrtcGetCUBIN");
    int major = 0, minor = 0;
    check(version(&major, &minor), "nvrtcVersion");
    if (major > latest)
      throw Error(ErrorKind::bad_input, "NVIDIA's compiler '" + library.name() + "' is of CUDA " +
                                            std::to_string(major) + "." + std::to_string(minor) +
                                            ", and the driver cannot run its code; update the driver, or set " +
                                            "RELIGN_LIBNVRTC to the libnvrtc.so of CUDA " + std::to_string(latest));
  }

  static std::vector<std::string> names(int latest) {
    std::vector<std::string> all;
    for (int major = std::min(latest, kLatestCuda); major >= 12; --major)
      all.push_back("libnvrtc.so." + std::to_string(major));
    all.insert(all.end(), {"libnvrtc.so", "/usr/local/cuda/lib64/libnvrtc.so", "/usr/local/cuda/lib/libnvrtc.so"});
    return all;
  }

  void check(int result, const char* call) const {
    if (result != 0)
      throw Error(ErrorKind::bad_input,
                  "NVIDIA's compiler '" + library.name() + "' is broken: " + call + ": " + error_text(result));
  }

  SharedLibrary library;
  int (*version)(int*, int*) = nullptr;
  const char* (*error_text)(int) = nullptr;
  int (*create)(void**, const char*, const char*, int, const char* const*, const char* const*) = nullptr;
  int (*destroy)(void**) = nullptr;
  int (*compile)(void*, int, const char* const*) = nullptr;
  int (*log_size)(void*, std::size_t*) = nullptr;
  int (*log)(void*, char*) = nullptr;
  int (*ptx_size)(void*, std::size_t*) = nullptr;
  int (*ptx)(void*, char*) = nullptr;
  int (*code_size)(void*, std::size_t*) = nullptr;
  int (*code)(void*, char*) = nullptr;
};

class Program {
 public:
  explicit Program(const Nvrtc& nvrtc) : nvrtc_(nvrtc) {
    std::vector<const char*> names, texts;
    for (const KernelSource& source : kernel_sources()) {
      names.push_back(source.name.c_str());
      texts.push_back(source.text.c_str());
    }
    nvrtc_.check(
        nvrtc_.create(&program_, kProgram, "kernels.cu", static_cast<int>(names.size()), texts.data(), names.data()),
        "nvrtcCreateProgram");
  }
  ~Program() { nvrtc_.destroy(&program_); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  std::string compile(const std::string& architecture) {
    const std::string target = "--gpu-architecture=" + architecture;
    std::vector<const char*> options(std::begin(kCompileOptions), std::end(kCompileOptions));
    options.push_back(target.c_str());
    const int result = nvrtc_.compile(program_, static_cast<int>(options.size()), options.data());
    if (result != 0)
      throw Error(ErrorKind::bad_input,
                  "NVIDIA's compiler '" + nvrtc_.library.name() + "' cannot compile the kernels for '" + architecture +
                      "': " + nvrtc_.error_text(result) + first_line(text(nvrtc_.log_size, nvrtc_.log)));
    return architecture.rfind("sm_", 0) == 0 ? text(nvrtc_.code_size, nvrtc_.code) : text(nvrtc_.ptx_size, nvrtc_.ptx);
  }

 private:
  std::string text(int (*size)(void*, std::size_t*), int (*get)(void*, char*)) const {
    std::size_t bytes = 0;
    nvrtc_.check(size(program_, &bytes), "nvrtcGetSize");
    std::string result(bytes, '\0');
    nvrtc_.check(get(program_, result.data()), "nvrtcGet");
    return result;
  }
  static std::string first_line(const std::string& log) {
    const std::size_t end = std::min(log.find_first_of(std::string("\n\0", 2)), log.size());
    return end == 0 ? "" : ": " + log.substr(0, end);
  }

  const Nvrtc& nvrtc_;
  void* program_ = nullptr;
};

}  // namespace

std::string nvrtc_problem() {
  try {
    const Nvrtc nvrtc(kLatestCuda);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

std::string compile_kernels(const std::string& architecture, int latest) {
  const Nvrtc nvrtc(latest);
  return Program(nvrtc).compile(architecture);
}

std::string cached_kernels(const std::string& architecture, const std::filesystem::path& cache, int latest) {
  if (cache.empty()) return compile_kernels(architecture, latest);
  std::string content = kProgram + architecture + "\n" + std::to_string(latest);
  for (const char* option : kCompileOptions) content += option;
  for (const KernelSource& source : kernel_sources()) content += source.name + source.text;
  const std::filesystem::path file = cache / ("kernels-" + short_hash(content) + ".cubin");
  std::error_code code;
  if (std::filesystem::exists(file, code)) {
    const std::string kept = read_file(file);
    const std::size_t end = kept.find('\n');
    // A damaged file is written again.
    if (end != std::string::npos && kept.compare(0, end, sha256_hex(kept.substr(end + 1))) == 0)
      return kept.substr(end + 1);
  }
  std::string kernels = compile_kernels(architecture, latest);
  write_file_atomically(file, sha256_hex(kernels) + "\n" + kernels);
  return kernels;
}

}  // namespace relign::gpu
