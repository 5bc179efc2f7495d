// `plugin new --onnx`: the folder of an agent that follows a foreign network.
#pragma once

#include "cli/app.h"

namespace relign::cli {

// Extensions::write_network_plugin: the network, its side file and a README, or nothing.
void write_network_plugin(Context& context, const NewNetworkPlugin& wanted);

}  // namespace relign::cli
