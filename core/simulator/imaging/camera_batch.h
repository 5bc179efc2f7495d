// Many frames in one call: every thread renders whole frames, which scales better than sharing one frame among threads.
// Same bits as Camera.
#pragma once

#include <memory>
#include <vector>

#include "imaging/camera.h"

namespace relign::imaging {

struct BatchItem {
  MountedLens* lens = nullptr;  // may be shared by several items
  const std::vector<double>* true_pose = nullptr;
  std::uint64_t seed = 0;
  float* pixels = nullptr;  // sensor.pixels() values
};

class CameraBatch {
 public:
  // scene and parallel must outlive the batch. Captures do not allocate.
  CameraBatch(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel);
  ~CameraBatch();

  void capture(const std::vector<BatchItem>& items);

 private:
  struct OneThread;
  Parallel* parallel_;
  std::vector<std::unique_ptr<OneThread>> cameras_;  // one per thread
};

}  // namespace relign::imaging
