// Trained networks, as the portable operators read them.
#include <stdexcept>

#include "policies/network.hpp"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    policies::portable_network(fuzz::text_of(data, size), {2, 20})->answer(std::vector<float>(800, 3.0F));
  } catch (const std::runtime_error&) {
  }
  return 0;
}
