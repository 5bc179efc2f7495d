// Pictures that a scene shows as its target.
#include "images/image_file.h"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::filesystem::path file = fuzz::scratch_folder() / "target";
  fuzz::write_scratch(file, fuzz::text_of(data, size));
  fuzz::accepted([&] {
    const images::Image image = images::read_image(file);
    fuzz::demand(image.values.size() == image.width * image.height && !image.values.empty(), "an image");
  });
  return 0;
}
