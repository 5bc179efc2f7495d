#include "imaging/camera_batch.h"

namespace relign::imaging {

struct CameraBatch::OneThread {
  OneThread(const SceneFile& scene, const CaptureSettings& settings) : camera(scene, settings, alone) {}
  Parallel alone{1};
  Camera camera;
};

CameraBatch::CameraBatch(const SceneFile& scene, const CaptureSettings& settings, Parallel& parallel)
    : parallel_(&parallel) {
  for (unsigned thread = 0; thread < parallel.threads(); ++thread)
    cameras_.push_back(std::make_unique<OneThread>(scene, settings));
}

CameraBatch::~CameraBatch() = default;

void CameraBatch::capture(const std::vector<BatchItem>& items) {
  parallel_->for_each(static_cast<int>(items.size()), [&](int index, unsigned thread) {
    const BatchItem& item = items[static_cast<std::size_t>(index)];
    cameras_[thread]->camera.capture(*item.lens, *item.true_pose, item.seed, item.pixels);
  });
}

}  // namespace relign::imaging
