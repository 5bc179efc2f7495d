// The kernels compile by NVRTC, without a GPU, to instructions that round as the CPU's.
#include "gpu/nvrtc.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

#include "base/error.h"
#include "base/files.h"
#include "gpu/gpu.h"
#include "gpu/kernel_sources.h"

namespace relign::gpu::nvrtc {
namespace {

using testing::HasSubstr;
using testing::Not;

class Nvrtc : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string problem = nvrtc_problem(); !problem.empty()) GTEST_SKIP() << problem;
  }
};

TEST_F(Nvrtc, CompilesKernelsThatRoundAsIeeeSays) {
  for (const char* architecture : {"compute_80", "compute_90"}) {
    const std::string ptx = compile_kernels(architecture);
    for (const char* kernel : Gpu::kKernels) EXPECT_THAT(ptx, HasSubstr(std::string(".entry ") + kernel + "("));
    for (const char* exact : {"sqrt.rn.f32", "div.rn.f32", "fma.rn.f32", "mul.rn.f64", "div.rn.f64"})
      EXPECT_THAT(ptx, HasSubstr(exact));
    // fma.rn.f64 is written nowhere: there it would be a fused product and sum.
    for (const char* inexact : {".approx", ".ftz", "fma.rn.f64", "mad.f32"}) EXPECT_THAT(ptx, Not(HasSubstr(inexact)));
  }
}

TEST_F(Nvrtc, CompilesMachineCode) {
  EXPECT_EQ(compile_kernels("sm_90").substr(0, 4),
            "\x7f"
            "ELF");
}

TEST_F(Nvrtc, NamesAnUnknownArchitecture) {
  try {
    compile_kernels("sm_12");
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("cannot compile the kernels for 'sm_12'"));
  }
}

TEST_F(Nvrtc, KeepsKernelsAndReplacesDamagedOnes) {
  const std::filesystem::path folder = testing::TempDir() + "relign-kernels";
  std::filesystem::remove_all(folder);
  const std::string compiled = cached_kernels("compute_90", folder);
  ASSERT_FALSE(std::filesystem::is_empty(folder));
  const std::filesystem::path file = std::filesystem::directory_iterator(folder)->path();
  const std::string kept = read_file(file);
  EXPECT_EQ(cached_kernels("compute_90", folder), compiled);
  for (const std::string& damaged : {kept.substr(0, kept.size() / 2), std::string("no line end"), std::string()}) {
    std::ofstream(file, std::ios::binary) << damaged;
    EXPECT_EQ(cached_kernels("compute_90", folder), compiled);
    EXPECT_EQ(read_file(file), kept);
  }
  std::filesystem::remove_all(folder);
}

TEST(KernelSources, AreWhatTheKernelsInclude) {
  std::vector<std::string> names;
  for (const KernelSource& source : kernel_sources()) names.push_back(source.name);
  for (const KernelSource& source : kernel_sources())
    for (std::size_t at = source.text.find("#include"); at != std::string::npos;
         at = source.text.find("#include", at + 1)) {
      const std::size_t from = source.text.find_first_of("<\"", at) + 1;
      EXPECT_THAT(names, testing::Contains(source.text.substr(from, source.text.find_first_of(">\"", from) - from)))
          << source.name;
    }
}

TEST(NvrtcLibrary, IsNamedWhenBroken) {
  ::setenv("RELIGN_LIBNVRTC", "/none/libnvrtc.so", 1);
  EXPECT_THAT(nvrtc_problem(), HasSubstr("NVRTC was not found (/none/libnvrtc.so: "));
  ::setenv("RELIGN_LIBNVRTC", "libm.so.6", 1);
  EXPECT_EQ(nvrtc_problem(), "'libm.so.6' has no function 'nvrtcVersion'");
  ::unsetenv("RELIGN_LIBNVRTC");
}

}  // namespace
}  // namespace relign::gpu::nvrtc
