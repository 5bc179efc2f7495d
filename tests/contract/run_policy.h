// Helpers for tests of agents with a trained network: grey images, and a network that outputs their brightness.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "base/error.h"
#include "contract/run_plugin.h"

namespace relign::test {

// Grey images for the network of tests/golden/policies: axis 0 is the brightness of the newest frame, axis 1 half that
// of the frame before.
struct GreyTrial {
  explicit GreyTrial(double brightness, double reference_value = 0) {
    setup.axes = 2;
    setup.budget = 6;
    setup.observes = RELIGN_OBSERVES_IMAGES;
    setup.largest_move = 0.2;
    setup.image_side = 40;
    setup.merit = [](const Pose&, std::uint32_t) { return 0.0; };
    setup.paint = [brightness](double, float* pixels) {
      std::fill(pixels, pixels + 1600,
                static_cast<float>(brightness * 0.3));  // 255 corresponds to three times white, 0.1
    };
    wanted.assign(1600, static_cast<float>(reference_value));
    image = {sizeof image, RELIGN_SAMPLE_FLOAT32, 40, 40, 1, 0, wanted.data(), 40 * sizeof(float)};
    reference.struct_size = sizeof reference;
    reference.image = &image;
    setup.service = [this](std::string_view id) -> const void* {
      return id == RELIGN_SERVICE_REFERENCE ? &reference : nullptr;
    };
  }
  FakeSetup setup;
  std::vector<float> wanted;
  relign_image image{};
  relign_reference_service reference{};
};

// Runs one trial of the agent in this folder of the tree, with that network unless `parameters` name another one.
inline void run_policy(const std::string& folder, const FakeTrial& trial, Json parameters = Json::object()) {
  if (!parameters.contains("model"))
    parameters["model"] = std::string(RELIGN_SOURCE_DIR) + "/tests/golden/policies/tiny.onnx";
  std::string id = folder;
  std::replace(id.begin(), id.end(), '_', '-');
  run_plugin(folder, id, parameters, trial);
}

// The message with which it refuses the trial; empty when it runs.
inline std::string refusal(const std::string& folder, const FakeTrial& trial, const Json& parameters = Json::object()) {
  try {
    run_policy(folder, trial, parameters);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

}  // namespace relign::test
