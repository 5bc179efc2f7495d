// For tests of the conformance checks: a small sound noise level; with a CROOKED_* defined, one that breaks a promise.
#include <relign/plugin.hpp>
#include <relign/random.hpp>
#include <string>

namespace {

class CrookedLevel final : public relign::NoiseLevel {
 public:
  explicit CrookedLevel(const relign::Parameters&) {}
  std::string draw(std::uint64_t seed, std::string_view scene_json) override {
    std::size_t axes = 0;
    for (std::size_t at = scene_json.find("\"unit\""); at != std::string_view::npos;
         at = scene_json.find("\"unit\"", at + 1))
      ++axes;
#ifdef CROOKED_REMEMBERS
    static std::uint64_t draws = 0;
    seed += ++draws;
#endif
#ifdef CROOKED_OUTSIDE
    const double scale = 10;
#else
    const double scale = 1;
#endif
    relign::Random random(seed);
    std::string start, distortion;
    for (std::size_t row = 0; row < axes; ++row) {
      start += (row ? "," : "") + std::to_string(scale * random.uniform());
      distortion += row ? ",[" : "[";
      for (std::size_t column = 0; column < axes; ++column)
        distortion += std::string(column ? "," : "") + (row == column ? "1" : "0");
      distortion += "]";
    }
    return "{\"start\": [" + start + "], \"distortion\": [" + distortion + "], \"elements\": {}}";
  }
};

}  // namespace

RELIGN_PLUGIN(CrookedLevel)
