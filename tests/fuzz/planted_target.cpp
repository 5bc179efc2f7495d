// A reader with a mistake that the driver must find (mutate_test.cpp).
#include <stdexcept>

#include "target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = relign::fuzz::text_of(data, size);
  relign::fuzz::accepted([&] {
    if (text.find('<') != std::string::npos) throw std::out_of_range("no Error of ours");
  });
  return 0;
}
