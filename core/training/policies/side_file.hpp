// The JSON side file that `relign-train` writes beside a network: the input the network expects, the scene it was
// trained for, and parity inputs with the outputs that every program must reproduce.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace relign::policies {

// How the answers of a network that predicts its own errors are combined (belief.hpp).
struct Doubt {
  std::vector<std::vector<double>> directions;  // unit vectors in shares of the travel per axis
  std::vector<double> effects;  // mean squared change of a pixel per squared share of the travel along each direction
  std::vector<double> floor;    // standard deviation along each direction of the error that all answers share
  double drift = 0;             // what an answer loses when the stage has moved, as a share of the distance
};

struct SideFile {
  std::string scene;              // id
  std::vector<std::string> axes;  // names, in the order of the output
  int size = 0;                   // columns and rows of the network's input
  int frames = 1;                 // stacked captures, the newest last; zeros before the first capture
  double white = 0;               // display value of a lit pixel
  double byte_whites = 0;         // byte 255 is this multiple of `white`
  bool irradiance = false;        // the input has the scene's units ("values": "irradiance"), without bytes
  // The network's input is (value - mean) / deviation, and its outputs times `scales` are shares of the travel: for
  // networks that were not trained by relign-train. Parity inputs and outputs are those of the network itself.
  double mean = 0, deviation = 1;
  std::vector<double> scales;  // per axis; empty: 1
  bool displacement = true;    // output: the displacement to the optimum ("way"); false: the next move ("move")
  // Set: a displacement is followed by the logarithms of the standard deviations of its errors along the directions.
  std::optional<Doubt> doubt;
  bool portable = true;        // "reproducible": "anywhere", the same bits on every processor
  std::string weights_sha256;  // of the ONNX file
  std::string command;         // the training command
  // The reference image as means over blocks x blocks parts, which identifies the scene.
  int blocks = 0;
  std::vector<float> reference;
  // A parity input: `frames` images of 10 x 10 bytes, each byte a block of size / 10 pixels; and the expected output.
  // As irradiance, a byte is that share of 255 of byte_whites * white.
  struct Parity {
    std::vector<std::uint8_t> bytes;
    std::vector<float> answer;
  };
  std::vector<Parity> parity;

  // Number of values that the network returns.
  std::size_t outputs() const { return doubt ? 2 * axes.size() : axes.size(); }
  // The parity input in the network's input format: frames x size x size.
  std::vector<float> shown(const Parity& parity) const;
};

// Throws std::runtime_error that names the file and the error in it.
SideFile read_side_file(const std::string& path);

}  // namespace relign::policies
