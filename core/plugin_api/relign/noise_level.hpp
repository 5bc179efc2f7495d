// relign/noise_level.hpp: the class that noise levels derive from. Comes with relign/plugin.hpp.
#ifndef RELIGN_NOISE_LEVEL_HPP
#define RELIGN_NOISE_LEVEL_HPP

#include <cstdint>
#include <string>
#include <string_view>

namespace relign {

class NoiseLevel {
 public:
  virtual ~NoiseLevel() = default;
  // One draw of W as JSON, a pure function of the arguments; see relign_noise_level_interface.
  virtual std::string draw(std::uint64_t seed, std::string_view scene_json) = 0;
};

}  // namespace relign

#endif  // RELIGN_NOISE_LEVEL_HPP
