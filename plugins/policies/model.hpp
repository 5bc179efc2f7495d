// A trained model: network and side file, checked against each other once per process.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "network.hpp"
#include "side_file.hpp"

namespace relign::policies {

// From an ONNX file and the .json beside it. Throws std::runtime_error with the reason: truncated, no side file,
// another network than the side file's, answers that differ from the parity set's by more than 1e-4, or that are not
// finite.
//
// Networks are kept in the process and lent to one model at a time, so that a hundred trials read and check the file
// once.
class Model {
 public:
  explicit Model(const std::string& onnx_path);
  ~Model();
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

  const SideFile& about() const;
  // `pictures`: frames x size x size bytes as float, the newest last. One value an axis, all finite; throws
  // std::runtime_error otherwise.
  std::vector<double> answer(const std::vector<float>& pictures);

 private:
  struct Kept;
  std::shared_ptr<Kept> kept_;
  std::unique_ptr<Network> network_;
};

}  // namespace relign::policies
