// Batches give the same images as the camera, and do not allocate.
#include "imaging/camera_batch.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "scene_under_test.h"

namespace {
std::atomic<long> allocations{0};
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace relign::imaging::camera_batch {
namespace {

constexpr std::size_t kPixels = 200 * 200;

TEST(CameraBatch, MatchesCameraWithoutAllocating) {
  const SceneFile& scene = relign_od_scene();
  Random random(9);
  std::vector<std::unique_ptr<MountedLens>> lenses;
  for (int i = 0; i < 3; ++i) lenses.push_back(std::make_unique<MountedLens>(scene, random_assembly(random)));
  std::vector<std::vector<double>> poses;
  for (int i = 0; i < 12; ++i) poses.push_back(random_pose(random));
  std::vector<std::vector<float>> images(12, std::vector<float>(kPixels, -1.0F));
  std::vector<BatchItem> items;
  for (std::size_t i = 0; i < 12; ++i)  // the same lens in several items at once
    items.push_back({lenses[i / 4].get(), &poses[i], 100 + i, images[i].data()});

  Parallel parallel(3);
  CameraBatch batch(scene, {}, parallel);
  batch.capture(items);

  Parallel alone(1);
  Camera camera(scene, {}, alone);
  std::vector<float> expected(kPixels);
  for (std::size_t i = 0; i < 12; ++i) {
    camera.capture(*lenses[i / 4], poses[i], 100 + i, expected.data());
    EXPECT_EQ(images[i], expected) << i;
  }

  // Each thread must have rendered once; the assignment of frames to threads is random.
  for (int i = 0; i < 20; ++i) batch.capture(items);
  const long before = allocations;
  for (int i = 0; i < 5; ++i) batch.capture(items);
  EXPECT_EQ(allocations, before);
}

}  // namespace
}  // namespace relign::imaging::camera_batch
