// Many frames in one call: every thread renders whole frames by itself, which scales with the cores where
// one frame's threads have to wait for each other. The same bits as Camera gives.
#pragma once

#include <memory>
#include <vector>

#include "imaging/camera.h"

namespace relign::imaging {

struct BatchItem {
  MountedLens* lens = nullptr;  // may stand in several items
  const std::vector<double>* true_pose = nullptr;
  std::uint64_t seed = 0;
  float* pixels = nullptr;  // sensor.pixels() values
};

class CameraBatch {
 public:
  // scene and parallel outlive the batch. Allocates everything; captures allocate nothing.
  CameraBatch(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel);
  ~CameraBatch();

  void capture(const std::vector<BatchItem>& items);

 private:
  struct OneThread;
  Parallel* parallel_;
  std::vector<std::unique_ptr<OneThread>> cameras_;  // one a thread
};

}  // namespace relign::imaging
