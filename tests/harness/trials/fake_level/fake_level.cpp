#include <relign/plugin.hpp>

namespace {

class FakeLevel final : public relign::NoiseLevel {
 public:
  explicit FakeLevel(const relign::Parameters& given)
      : malformed_(given.boolean("malformed")), batches_(given.boolean("batches")) {}

  std::string draw(std::uint64_t seed, std::string_view scene_json) override {
    if (scene_json.find("\"fake\"") == std::string_view::npos) throw std::runtime_error("not the scene's description");
    relign::Random random(seed);
    std::string start;
    for (int axis = 0; axis < 3; ++axis) start += (axis ? ", " : "") + std::to_string(random.uniform());
    if (malformed_ && !batches_) start = "0.5, 2, 0.5";
    return "{\"start\": [" + start +
           "], \"distortion\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], \"elements\": {\"L1\": {\"shift_mm\": [0.1, 0, 0]}}, "
           "\"cure_shift\": [0.01, 0, 0], " +
           (batches_ ? batch(seed) : std::string()) +
           "\"stage\": {\"backlash\": [0.01, 0, 0], \"drift\": [0, -0.5, 0], \"drift_seconds\": 60}}";
  }

 private:
  std::string batch(std::uint64_t seed) const {
    const double mean = relign::Random(seed, 1).uniform(-0.01, 0.01);
    return "\"batch\": {\"size\": " + std::to_string(malformed_ ? 2 + seed % 100 : 5) + ", \"cure_shift\": [0, " +
           std::to_string(mean) + ", 0.002], \"inspection\": [0, 0.001, 0.002]}, ";
  }

  bool malformed_, batches_;
};

}  // namespace

RELIGN_PLUGIN(FakeLevel)
