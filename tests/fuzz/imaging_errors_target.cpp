// Files of imaging errors, drawn from and applied to a small capture.
#include <cmath>

#include "imaging/capture_errors.h"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  fuzz::accepted([&] {
    imaging::Sensor sensor;
    sensor.width = 17;
    sensor.height = 9;
    sensor.pitch_mm = sensor.file_pitch_mm = 0.01;
    imaging::CaptureErrors errors(imaging::read_imaging_errors(JsonSource::from_text(text, "errors.json")), sensor, 0.2,
                                  100);
    std::vector<float> pixels(sensor.pixels(), 0.1F);
    for (std::uint64_t seed = 0; seed < 3; ++seed)
      if (errors.draw(seed)) errors.apply(pixels.data());
    for (const float pixel : pixels) fuzz::demand(std::isfinite(pixel), "an image");
  });
  return 0;
}
