#include "policies/network.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <relign/instruction_set.hpp>
#include <sstream>

#include "base/files.h"
#include "base/hash.h"
#include "policies/dense_kernel.hpp"
#include "policies/onnx_writer.h"
#include "policies/side_file.hpp"

namespace relign::policies {
namespace {

namespace fs = std::filesystem;
using test::Chain;
using testing::AllOf;
using testing::HasSubstr;

const fs::path kGolden = fs::path(RELIGN_SOURCE_DIR) / "tests/golden/policies";
const fs::path kAgents = fs::path(RELIGN_SOURCE_DIR) / "plugins/agents";
const char* const kShipped[] = {"imitation/imitation", "imitation_ppo/imitation-ppo", "ppo_paper/ppo-paper"};

// A linear congruential generator: the same numbers in every run and on every machine.
class Draws {
 public:
  explicit Draws(std::uint32_t seed) : state_(seed * 2654435761U + 1) {}
  float centred() {  // -1 to 1
    state_ = state_ * 1664525U + 1013904223U;
    return static_cast<float>(state_ >> 8) / static_cast<float>(1U << 23) - 1;
  }
  std::int64_t from(std::int64_t least, std::int64_t most) {
    return least +
           static_cast<std::int64_t>((centred() + 1) / 2 * static_cast<float>(most - least + 1)) % (most - least + 1);
  }
  std::vector<float> values(std::int64_t count, float scale) {
    std::vector<float> values(static_cast<std::size_t>(count));
    for (float& value : values) value = scale * centred();
    return values;
  }

 private:
  std::uint32_t state_;
};

std::string refusal(const std::string& bytes, InputShape shape) {
  try {
    portable_network(bytes, shape);
    return "";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

bool has_opencv() {
  try {
    opencv_network(read_file(kGolden / "tiny.onnx"), {2, 20});
    return true;
  } catch (const std::runtime_error&) {
    return false;
  }
}

void expect_near(const std::vector<float>& ours, const std::vector<float>& theirs, const std::string& what) {
  ASSERT_EQ(ours.size(), theirs.size()) << what;
  float largest = 1e-3F;
  for (const float value : theirs) largest = std::max(largest, std::fabs(value));
  for (std::size_t i = 0; i < ours.size(); ++i)
    EXPECT_NEAR(ours[i], theirs[i], 1e-5F * largest) << what << ", output " << i;
}

TEST(PortableNetwork, MatchesNumPyForEveryOperator) {
  const auto network = portable_network(read_file(kGolden / "operators.onnx"), {2, 20});
  std::vector<float> input(800);
  for (std::size_t i = 0; i < input.size(); ++i) input[i] = static_cast<float>((37 * i + 11) % 256);
  const std::vector<float> answer = network->answer(input);
  std::istringstream golden(read_file(kGolden / "operators.txt"));
  std::size_t count = 0;
  for (double value = 0; golden >> value; ++count)
    EXPECT_NEAR(static_cast<double>(answer.at(count)), value, 3e-6) << count;
  EXPECT_EQ(count, answer.size());
  EXPECT_EQ(network->answer(input), answer);  // no state remains from the first call
}

TEST(PortableNetwork, MatchesOpenCvOnTheShippedNetworks) {
  if (!has_opencv()) GTEST_SKIP() << "built without OpenCV's dnn";
  for (const char* name : kShipped) {
    const SideFile about = read_side_file((kAgents / (name + std::string(".json"))).string());
    const std::string bytes = read_file(kAgents / (name + std::string(".onnx")));
    const InputShape shape = {about.frames, about.size};
    const auto ours = portable_network(bytes, shape), theirs = opencv_network(bytes, shape);
    for (const SideFile::Parity& parity : about.parity) {
      const std::vector<float> input = about.shown(parity);
      expect_near(ours->answer(input), theirs->answer(input), name);
    }
  }
}

TEST(PortableNetwork, MatchesOpenCvOnRandomNetworks) {
  if (!has_opencv()) GTEST_SKIP() << "built without OpenCV's dnn";
  for (std::uint32_t seed = 0; seed < 40; ++seed) {
    Draws draws(seed);
    const std::int64_t frames = draws.from(1, 4);
    std::int64_t side = draws.from(12, 40), channels = frames;
    const InputShape shape = {static_cast<int>(frames), static_cast<int>(side)};
    Chain chain(frames, side);
    for (std::int64_t layer = draws.from(1, 3); layer > 0 && side > 4; --layer) {
      const std::int64_t outputs = draws.from(1, 40), kernel = draws.from(1, 4), stride = draws.from(1, 2),
                         pad = draws.from(0, kernel / 2);
      const std::string w = "w" + std::to_string(layer), b = "b" + std::to_string(layer);
      const std::int64_t depth = channels * kernel * kernel;
      chain
          .weight(w, {outputs, channels, kernel, kernel},
                  draws.values(outputs * depth, 2 / std::sqrt(static_cast<float>(depth))))
          .weight(b, {outputs}, draws.values(outputs, 1))
          .then("Conv", {w, b},
                test::integers("kernel_shape", {kernel, kernel}) + test::integers("strides", {stride, stride}) +
                    test::integers("pads", {pad, pad, pad, pad}));
      side = (side + 2 * pad - kernel) / stride + 1;
      channels = outputs;
      const char* const functions[] = {"Relu", "Tanh", "Sigmoid", "Elu", "LeakyRelu"};
      const std::string function = functions[draws.from(0, 4)];
      chain.then(function, {},
                 function == "Elu"         ? test::real("alpha", 1)
                 : function == "LeakyRelu" ? test::real("alpha", 0.2F)
                                           : "");
      if (side >= 4 && draws.from(0, 1) == 1) {
        chain.then("MaxPool", {}, test::integers("kernel_shape", {2, 2}) + test::integers("strides", {2, 2}));
        side = (side - 2) / 2 + 1;
      }
    }
    chain.then("Flatten", {}, test::integer("axis", 1));
    const std::int64_t numbers = channels * side * side, outputs = draws.from(1, 50);
    chain.weight("wg", {outputs, numbers}, draws.values(outputs * numbers, 2 / std::sqrt(static_cast<float>(numbers))))
        .weight("bg", {outputs}, draws.values(outputs, 1))
        .then("Gemm", {"wg", "bg"}, test::integer("transB", 1));
    const std::string file = chain.file();
    const std::vector<float> input = draws.values(frames * shape.size * shape.size, 1);
    expect_near(portable_network(file, shape)->answer(input), opencv_network(file, shape)->answer(input),
                "seed " + std::to_string(seed));
  }
}

// Compares with sums in single precision, one output at a time.
TEST(DenseKernel, EveryInstructionSetAddsInTheDefinedOrder) {
  const std::map<const char*, std::pair<InstructionSet, Multiply>> sets = {
    {"generic", {InstructionSet::generic, &generic::multiply}},
#if defined(__x86_64__)
    {"avx2", {InstructionSet::avx2, &avx2::multiply}},
    {"avx512", {InstructionSet::avx512, &avx512::multiply}},
#endif
  };
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    Draws draws(seed);
    const auto pixels = static_cast<int>(draws.from(1, 30)), runs = static_cast<int>(draws.from(1, 4)),
               length = static_cast<int>(draws.from(1, 20)), outputs = static_cast<int>(draws.from(1, 150));
    const std::ptrdiff_t pixel_stride = draws.from(1, 9), run_stride = draws.from(1, 50);
    const int depth = runs * length, blocks = (outputs + kLanes - 1) / kLanes;
    const std::vector<float> input = draws.values((pixels - 1) * pixel_stride + (runs - 1) * run_stride + length, 1),
                             weights = draws.values(std::int64_t{blocks} * depth * kLanes, 1),
                             bias = draws.values(std::int64_t{blocks} * kLanes, 1);
    std::vector<float> expected;
    for (int p = 0; p < pixels; ++p)
      for (int n = 0; n < outputs; ++n) {
        float sum = bias[static_cast<std::size_t>(n)];
        for (int k = 0; k < depth; ++k) {
          const std::ptrdiff_t at = p * pixel_stride + k / length * run_stride + k % length;
          const float product = input[static_cast<std::size_t>(at)] *
                                weights[static_cast<std::size_t>((n / kLanes * depth + k) * kLanes + n % kLanes)];
          sum += product;
        }
        expected.push_back(sum);
      }
    for (const auto& [name, set] : sets) {
      if (!processor_has(set.first)) continue;
      std::vector<float> output(expected.size() + 1, 7.0F);  // one extra value detects a write past the end
      set.second({input.data(), pixel_stride, run_stride, pixels, runs, length, outputs, weights.data(), bias.data(),
                  output.data()});
      EXPECT_EQ(output.back(), 7.0F);
      output.pop_back();
      EXPECT_EQ(output, expected) << name << ", seed " << seed;
    }
  }
}

// Run by the test below, once for each instruction set: prints a hash of all outputs.
TEST(PortableNetwork, DISABLED_PrintHash) {
  std::string bytes;
  const auto add = [&bytes](const std::vector<float>& values) {
    bytes += test::raw(values.data(), values.size() * sizeof(float));
  };
  for (const char* name : kShipped) {
    const SideFile about = read_side_file((kAgents / (name + std::string(".json"))).string());
    const auto network =
        portable_network(read_file(kAgents / (name + std::string(".onnx"))), {about.frames, about.size});
    for (const SideFile::Parity& parity : about.parity) add(network->answer(about.shown(parity)));
  }
  const auto network = portable_network(read_file(kGolden / "operators.onnx"), {2, 20});
  Draws draws(1);
  for (int i = 0; i < 50; ++i) add(network->answer(draws.values(800, 300)));
  std::printf("hash %s\n", sha256_hex(bytes).c_str());
}

// The hash is the same on every processor, with every compiler and optimisation; it changes with a network or golden
// file.
TEST(PortableNetwork, GivesTheSameBitsOnEveryInstructionSet) {
  for (const char* isa : {"generic", "avx2", "avx512"}) {
    if (std::string(isa) == "avx2" && !processor_has(InstructionSet::avx2)) continue;
    if (std::string(isa) == "avx512" && !processor_has(InstructionSet::avx512)) continue;
    const std::string command = std::string("RELIGN_ISA=") + isa + " '" + fs::read_symlink("/proc/self/exe").string() +
                                "' --gtest_also_run_disabled_tests --gtest_filter=PortableNetwork.DISABLED_PrintHash";
    FILE* pipe = ::popen(command.c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    char line[256];
    std::string hash;
    while (std::fgets(line, sizeof line, pipe))
      if (std::string(line).rfind("hash ", 0) == 0) hash = std::string(line).substr(5, 64);
    ASSERT_EQ(::pclose(pipe), 0) << command;
    EXPECT_EQ(hash, "345f5b21eab892d01824c423190219ff88d167a3b6d57ef8e0a3ebd0f87f6798") << isa;
  }
}

TEST(PortableNetwork, RejectsUnsupportedNetworks) {
  EXPECT_THAT(
      refusal(Chain(1, 20).then("Softplus").file(), {1, 20}),
      AllOf(HasSubstr("operator Softplus (node1) is not one of the portable operators"), HasSubstr("Conv, Div")));
  EXPECT_THAT(refusal(Chain(1, 20, 6).then("Relu").file(), {1, 20}), HasSubstr("operator set '6' is not supported"));
  EXPECT_THAT(refusal(Chain(1, 20).then("Relu").file(), {2, 20}),
              HasSubstr("does not accept an input of 1 x 2 x 20 x 20"));
  Chain wide(1, 20);
  wide.weight("w", {3, 2, 3, 3}, std::vector<float>(54)).then("Conv", {"w"});
  EXPECT_THAT(refusal(wide.file(), {1, 20}),
              HasSubstr("operator Conv (node1): the weights are for 2 channels, the input has 1"));
  Chain grouped(2, 20);
  grouped.weight("w", {2, 1, 3, 3}, std::vector<float>(18)).then("Conv", {"w"}, test::integer("group", 2));
  EXPECT_THAT(refusal(grouped.file(), {2, 20}), HasSubstr("groups are not supported"));
  Chain unknown(1, 20);
  unknown.then("Add", {"nothing"});
  EXPECT_THAT(refusal(unknown.file(), {1, 20}), HasSubstr("input 'nothing' is not computed"));
  Chain large(1, 20);
  large.weight("w", {1, 1, 30, 30}, std::vector<float>(900)).then("Conv", {"w"});
  EXPECT_THAT(refusal(large.file(), {1, 20}), HasSubstr("a kernel of 30 x 30 is too large for an input of 20 x 20"));
  EXPECT_THAT(refusal(Chain(1, 20)
                          .then("MaxPool", {}, test::integers("kernel_shape", {2, 2}) + test::integer("ceil_mode", 1))
                          .file(),
                      {1, 20}),
              HasSubstr("ceil_mode"));
  EXPECT_THAT(refusal("", {1, 20}), HasSubstr("not an ONNX network"));
}

TEST(PortableNetwork, PropagatesNan) {
  const std::string pool = test::integers("kernel_shape", {2, 2}) + test::integers("strides", {2, 2});
  const auto network = portable_network(Chain(1, 10).then("MaxPool", {}, pool).then("Relu").file(), {1, 10});
  for (const std::size_t place : {0U, 1U, 10U, 11U}) {
    std::vector<float> input(100, 1.0F);
    input[place] = std::nanf("");
    EXPECT_TRUE(std::isnan(network->answer(input)[0])) << place;
  }
}

}  // namespace
}  // namespace relign::policies
