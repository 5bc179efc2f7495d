// The JSON side file that `relign-train` writes beside a network: the input the network expects, the scene it was
// trained for, and parity inputs with the outputs that every program must reproduce.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "history.hpp"
#include "network.hpp"

namespace relign::policies {

// How the answers of a network that predicts its own errors are combined (belief.hpp).
struct Doubt {
  std::vector<std::vector<double>> directions;  // unit vectors in shares of the travel per axis
  std::vector<double> effects;  // mean squared change of a pixel per squared share of the travel along each direction
  std::vector<double> floor;    // standard deviation along each direction of the error that all answers share
  double drift = 0;             // what an answer loses when the stage has moved, as a share of the distance
};

// Poses that are visited before the network's output is followed, for scenes whose start may tell nothing.
struct Probes {
  std::vector<Pose> poses;  // relative to the start, in shares of the travel
  double until = 0;         // they end once the reading that measures the score is below this
};

struct SideFile {
  std::string scene;              // id
  std::vector<std::string> axes;  // names, in the order of the output
  int size = 0;                   // columns and rows of the network's images
  int rows = 0;                   // where they have another number of rows than columns; else 0
  int frames = 1;    // stacked captures, the newest last; zeros before the first capture; 0: the network sees no images
  double white = 0;  // display value of a lit pixel
  double byte_whites = 0;   // byte 255 is this multiple of `white`
  bool irradiance = false;  // the input has the scene's units ("values": "irradiance"), without bytes
  // The network's input is (value - mean) / deviation, and its outputs times `scales` are shares of the travel: for
  // networks that were not trained by relign-train. Parity inputs and outputs are those of the network itself.
  double mean = 0, deviation = 1;
  std::vector<double> scales;  // per axis; empty: 1
  bool displacement = true;    // output: the displacement to the optimum ("way"); false: the next move ("move")
  // Set: a displacement is followed by the logarithms of the standard deviations of its errors along the directions.
  std::optional<Doubt> doubt;
  // Set: the network also has, or of readings has only, earlier captures as input (history.hpp).
  std::optional<HistoryFormat> history;
  double largest_move = 0;  // per axis, of a network with a history; 0: that of the trial alone
  Probes probes;
  bool portable = true;        // "reproducible": "anywhere", the same bits on every processor
  std::string weights_sha256;  // of the ONNX file
  std::string command;         // the training command
  // The reference image as means over blocks x blocks parts, or the reference readings (blocks 0), which identify the
  // scene.
  int blocks = 0;
  std::vector<float> reference;
  // A parity input: `frames` images of 10 x 10 bytes, each byte a block of size / 10 pixels; and the expected output.
  // As irradiance, a byte is that share of 255 of byte_whites * white. Then a byte for each number of the history: b is
  // (b - 128) / 32.
  struct Parity {
    std::vector<std::uint8_t> bytes;
    std::vector<float> answer;
  };
  std::vector<Parity> parity;

  // Number of values that the network returns.
  std::size_t outputs() const { return doubt ? 2 * axes.size() : axes.size(); }
  InputShape shape() const;
  // The parity input in the network's input format: frames x rows x size, then the history.
  std::vector<float> shown(const Parity& parity) const;
};

// Throws std::runtime_error that names the file and the error in it.
SideFile read_side_file(const std::string& path);

}  // namespace relign::policies
