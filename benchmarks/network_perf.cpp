// One inference of the shipped networks: with the portable operators, and with OpenCV.
#include <benchmark/benchmark.h>

#include <fstream>
#include <iterator>
#include <string>

#include "policies/network.hpp"
#include "policies/side_file.hpp"

namespace {

using namespace relign::policies;

void network(benchmark::State& state, const std::string& name,
             std::unique_ptr<Network> (*made)(const std::string&, InputShape)) {
  const std::string path = std::string(RELIGN_AGENTS "/") + name;
  std::ifstream file(path + ".onnx", std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const SideFile about = read_side_file(path + ".json");
  const auto one = made(bytes, {about.frames, about.size});
  const std::vector<float> input = about.shown(about.parity.at(0));
  for (auto _ : state) benchmark::DoNotOptimize(one->answer(input));
}
BENCHMARK_CAPTURE(network, imitation, "imitation/imitation", &portable_network)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(network, imitation_opencv, "imitation/imitation", &opencv_network)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(network, ppo_paper, "ppo_paper/ppo-paper", &portable_network)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(network, ppo_paper_opencv, "ppo_paper/ppo-paper", &opencv_network)->Unit(benchmark::kMillisecond);

}  // namespace
