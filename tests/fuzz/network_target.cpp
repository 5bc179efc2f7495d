// Side files of trained networks. Agents know no room of ours, and throw what a plugin may throw.
#include <stdexcept>

#include "policies/side_file.hpp"
#include "target.h"

using namespace relign;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::filesystem::path file = fuzz::scratch_folder() / "net.json";
  fuzz::write_scratch(file, fuzz::text_of(data, size));
  try {
    const policies::SideFile side = policies::read_side_file(file.string());
    for (const policies::SideFile::Parity& parity : side.parity) side.shown(parity);
  } catch (const std::runtime_error&) {
  }
  return 0;
}
