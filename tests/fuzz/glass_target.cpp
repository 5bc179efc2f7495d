// Glass catalogues.
#include "lens_files/agf_reader.h"
#include "target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes = relign::fuzz::text_of(data, size);
  relign::fuzz::accepted([&] { relign::lens_files::read_agf(bytes, "cat.agf"); });
  return 0;
}
