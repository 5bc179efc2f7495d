// What stands beside a network, as `relign-train` writes it: what it must be shown, for which scene, and inputs with
// the answers that every program must give.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace relign::policies {

struct SideFile {
  std::string scene;              // id
  std::vector<std::string> axes;  // names, in the order of the output
  int size = 0;                   // columns and rows of what the network sees
  int frames = 1;                 // the newest last, zeros before the start
  double white = 0;               // display value of a lit pixel
  double byte_whites = 0;         // 255 stands for this many of them
  bool guesses = true;            // the output is the way to the optimum; else the next move
  bool portable = true;           // the same bits on every processor are promised ("reproducible": "anywhere")
  std::string weights_sha256;     // of the ONNX file
  std::string command;            // that trains another one
  // The reference image in blocks x blocks means: what the scene is recognised by.
  int blocks = 0;
  std::vector<float> reference;
  // Per parity input `frames` pictures of 10 x 10 bytes, each shown as blocks of size / 10 pixels, and what comes out.
  struct Parity {
    std::vector<std::uint8_t> bytes;
    std::vector<float> answer;
  };
  std::vector<Parity> parity;

  // The parity input as the network takes it.
  std::vector<float> shown(const Parity& parity) const;
};

// Throws std::runtime_error with the file and what is wrong in it.
SideFile read_side_file(const std::string& path);

}  // namespace relign::policies
