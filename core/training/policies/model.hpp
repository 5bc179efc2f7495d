// A trained model: an ONNX network and its side file, checked against each other once per process.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "network.hpp"
#include "side_file.hpp"

namespace relign::policies {

// Loads an ONNX file and the .json file of the same name. Throws std::runtime_error when a file is missing, truncated
// or damaged, when the network's SHA-256 differs from the side file's, or when its outputs differ from the parity
// outputs by more than 1e-4 or are not finite.
//
// Networks are cached for the life of the process and each is used by one Model at a time, so that many trials read and
// check a file once.
class Model {
 public:
  explicit Model(const std::string& onnx_path);
  ~Model();
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

  const SideFile& about() const;
  // images: frames x rows x size bytes as float or irradiances, the newest frame last, and then the history, if the
  // network has one (SideFile::shape). Returns SideFile::outputs()
  // finite values, the first ones in shares of the travel; throws std::runtime_error if the network returns anything
  // else.
  std::vector<double> answer(const std::vector<float>& images);

 private:
  struct Kept;
  std::shared_ptr<Kept> kept_;
  std::unique_ptr<Network> network_;
};

}  // namespace relign::policies
