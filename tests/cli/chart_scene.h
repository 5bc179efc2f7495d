// A small camera with a chart of slanted edges: fields as of camera_2mp, images in milliseconds.
#pragma once

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/program.h"

namespace relign::cli_test {

inline nlohmann::json chart_scene() {
  const std::string folder = std::string(RELIGN_SOURCE_DIR) + "/plugins/scenes/lens_system/camera_2mp/";
  nlohmann::json scene = nlohmann::json::parse(std::ifstream(folder + "scene.json"));
  scene["name"] = "chart";
  scene["lens"] = folder + "lens.json";
  scene["sensor"]["pitch_um"] = 12;
  scene["sensor"]["pixels"] = {480, 320};
  scene["sensor"].erase("electronics");
  scene["emitter"]["target"] = "slanted_edges:squares=5";
  scene["emitter"]["texels"] = 1024;
  return scene;
}

}  // namespace relign::cli_test
