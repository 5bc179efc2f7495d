// The side file of a network that relign-train did not make (`relign-bench plugin new --onnx`).
#pragma once

#include <relign/basics.hpp>
#include <string>
#include <vector>

namespace relign::policies {

// The scene that a network is for.
struct TargetScene {
  std::string id;
  std::vector<std::string> axes;
  double white;         // display value of a lit pixel
  ImageView reference;  // its size is that of all captures
};

// The text of a side file for the ONNX network `bytes`, with 64 parity inputs and what portable_network answers to
// them. Normalisation, scales and the meaning of the output are left at their defaults, for the author to fill in.
// `command` repeats this for another scene. Throws std::runtime_error that names what was found and what is allowed, if
// the network's input is not an image that captures of the scene can be binned to, if it has other operators than
// portable_operators(), or if it does not return one finite value per axis.
std::string new_side_file(const std::string& bytes, const std::string& weights_sha256, const TargetScene& scene,
                          const std::string& command);

}  // namespace relign::policies
