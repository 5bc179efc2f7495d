// The paper's chessboard: corners as OpenCV finds them in our image against the centroids of the real rays that each
// corner of the emitter sends through the lens.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "exact_rays.h"
#include "imaging/target.h"
#include "scene_under_test.h"

namespace relign::imaging {
namespace {

constexpr int kFields = 12;

const SceneFile& chessboard_scene() {
  static const SceneFile scene = [] {
    SceneChoices choices;
    choices.target = "chessboard:fields=" + std::to_string(kFields);
    return relign_od_scene_with(choices);
  }();
  return scene;
}

// Corners between four fields, by OpenCV alone; those of the board's border are among them. Its refinement takes edges
// for smooth over some pixels, ours are as sharp as a pixel: without the blur, corners are pulled by up to 0.1 px
// towards and away from pixels' middles as their place in the pixel goes (mean deviation 0.060 px instead of 0.030).
std::vector<cv::Point2f> corners_seen(const optics::Assembly& assembly, const std::vector<double>& pose) {
  const SceneFile& scene = chessboard_scene();
  Parallel parallel(2);
  Camera camera(scene, {}, parallel);
  MountedLens lens(scene, assembly);
  cv::Mat image(scene.sensor.height, scene.sensor.width, CV_32F), smooth;
  camera.render_noise_free(lens, pose, 4, 1024, image.ptr<float>());
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(image, corners, 400, 0.02, 4);
  cv::GaussianBlur(image, smooth, {0, 0}, 1);
  cv::cornerSubPix(smooth, corners, {3, 3}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::MAX_ITER, 100, 1e-4});
  return corners;
}

struct Deviations {
  double mean_px = 0, largest_px = 0;
  double shift_x_px = 0, shift_y_px = 0;  // of all corners together
};

// Of the corners found in an image at `pose` from those that rays give at `exact_pose`.
Deviations deviations(const optics::Assembly& assembly, const std::vector<double>& pose,
                      const std::vector<double>& exact_pose) {
  const SceneFile& scene = chessboard_scene();
  const std::vector<cv::Point2f> corners = corners_seen(assembly, pose);
  const auto emitter_mm = [&](int line) { return scene.emitter.side_mm * (1.0 * line / kFields - 0.5); };
  constexpr int kCorners = (kFields - 1) * (kFields - 1);
  Deviations found;
  for (int row = 1; row < kFields; ++row)
    for (int column = 1; column < kFields; ++column) {
      const PixelPlace exact =
          bundle_centroid(scene, assembly, exact_pose, {emitter_mm(column), emitter_mm(row), scene.emitter.z_mm});
      double nearest = std::numeric_limits<double>::infinity(), shift_x = 0, shift_y = 0;
      for (const cv::Point2f& corner : corners) {
        const double x = static_cast<double>(corner.x) - exact.x, y = static_cast<double>(corner.y) - exact.y;
        if (std::hypot(x, y) > nearest) continue;
        nearest = std::hypot(x, y);
        shift_x = x;
        shift_y = y;
      }
      EXPECT_LT(nearest, 1) << "no corner was found near " << exact.x << ", " << exact.y;
      found.mean_px += nearest / kCorners;
      found.largest_px = std::max(found.largest_px, nearest);
      found.shift_x_px += shift_x / kCorners;
      found.shift_y_px += shift_y / kCorners;
    }
  std::printf("%d corners: mean deviation %.4f px, largest %.4f px, together %.4f, %.4f px\n", kCorners, found.mean_px,
              found.largest_px, found.shift_x_px, found.shift_y_px);
  return found;
}

void expect_small(const Deviations& found) {
  EXPECT_LT(found.mean_px, 0.05);
  EXPECT_LT(std::hypot(found.shift_x_px, found.shift_y_px), 0.01);
}

TEST(Chessboard, CornersMatchRays) {
  const optics::Assembly perfect(chessboard_scene().lens);
  expect_small(deviations(perfect, nominal_pose(), nominal_pose()));
}

TEST(Chessboard, CornersMatchRaysWithOffsetsAtAPose) {
  Random random(3);
  const optics::Assembly assembly = random_assembly(random);
  const std::vector<double> pose = {0.56, 0.46, 0.5, 0.52, 0.47};
  expect_small(deviations(assembly, pose, pose));
}

TEST(Chessboard, ComparisonDetectsShift) {
  const optics::Assembly perfect(chessboard_scene().lens);
  // 4 micrometres to the right are 0.153 pixels.
  const Deviations found = deviations(perfect, {0.502, 0.5, 0.5, 0.5, 0.5}, nominal_pose());
  EXPECT_GT(found.mean_px, 0.1);
  EXPECT_NEAR(found.shift_x_px, 0.153 * 1.024, 0.01) << "the image of a lens moves with it, and 1 / 40 further";
}

}  // namespace
}  // namespace relign::imaging
