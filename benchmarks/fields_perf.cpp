// MTF of all fields of a capture of camera_2mp, as for every step of a trial with merit mtf.
#include <benchmark/benchmark.h>

#include <cmath>

#include "images/edge_fields.h"
#include "imaging/chart_fields.h"

namespace {

namespace images = relign::images;

// Dark squares at the marks, rotated like the chart's, on a white ground with a little noise.
images::Image capture_of(const images::EdgeFields& fields) {
  images::Image image(1920, 1280);
  for (std::size_t y = 0; y < image.height; ++y)
    for (std::size_t x = 0; x < image.width; ++x) {
      const auto noise = static_cast<double>((x * 7919 + y * 104729) % 1000) * 1e-6;
      double value = 0.1 + noise;
      for (const images::EdgeField& field : fields) {
        const double dx = static_cast<double>(x) - field.mark->x_px, dy = static_cast<double>(y) - field.mark->y_px;
        const double half = field.mark->side_px / 2;
        if (std::fabs(dx + 0.087 * dy) < half && std::fabs(dy - 0.087 * dx) < half) value = 0.01 + noise;
      }
      image.at(x, y) = static_cast<float>(value);
    }
  return image;
}

void fields_mtf(benchmark::State& state) {
  const auto scene = relign::imaging::read_scene_file(RELIGN_CAMERA_2MP_SCENE, {});
  const images::EdgeFields fields = relign::imaging::fields_of(scene);
  const images::Image capture = capture_of(fields);
  for (auto _ : state) {
    const images::FieldEdges edges(capture, fields);
    for (std::size_t field = 0; field < fields.size(); ++field)
      for (const auto direction : {images::Direction::tangential, images::Direction::sagittal}) {
        const double mtf = edges.mtf(field, direction, 0.125);
        if (std::isnan(mtf)) state.SkipWithError("an edge was not found");
        benchmark::DoNotOptimize(mtf);
      }
  }
}
BENCHMARK(fields_mtf)->Name("fields_mtf_1920x1280")->Unit(benchmark::kMillisecond);

// MTF and place of all fields by rays, as a specification by field judges a step.
void fields_by_rays(benchmark::State& state) {
  const auto scene = relign::imaging::read_scene_file(RELIGN_CAMERA_2MP_SCENE, {});
  const std::vector<relign::imaging::FieldPoint> points = relign::imaging::points_of_fields(scene);
  const relign::imaging::FieldMtfMeter meter(scene, true, false, 40);
  const relign::optics::Assembly lens(scene.lens);
  const std::vector<double> pose(scene.axes(), 0.5);
  for (auto _ : state)
    for (const relign::imaging::FieldPoint& point : points)
      benchmark::DoNotOptimize(meter.modulation_at(point, lens, pose, 50));
}
BENCHMARK(fields_by_rays)->Name("fields_by_rays_13")->Unit(benchmark::kMillisecond);

}  // namespace
