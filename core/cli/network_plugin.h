// `plugin new --onnx`: the folder of an agent that follows a foreign network.
#pragma once

#include <filesystem>
#include <string>

#include "cli/app.h"

namespace relign::cli {

struct NewNetworkPlugin {
  std::string name;  // of the folder's files
  std::string onnx;  // the network
  std::string scene;
  std::filesystem::path folder;  // is created; must not exist
};

// Writes the network, its side file and a README, or nothing. Throws Error: bad_input if the network cannot be used
// (what was found, what is allowed) or the folder exists; io.
void write_network_plugin(Context& context, const NewNetworkPlugin& wanted);

}  // namespace relign::cli
