#include <cstdio>
#include <relign/plugin.hpp>

namespace {

class ToyLevel final : public relign::NoiseLevel {
 public:
  explicit ToyLevel(const relign::Parameters& given) : width_(given.number("width")), element_(given.text("element")) {}

  std::string draw(std::uint64_t seed, std::string_view) override {
    relign::Random random(seed);
    const double x = random.uniform(0.1, 0.9);
    const double y = random.uniform(0.1, 0.9);
    char text[400];
    std::snprintf(
        text, sizeof text,
        R"({"start": [%.17g, %.17g], "distortion": [[1, 0.01], [0, 1]], "elements": {"%s": {"shift_mm": [%.17g, 0, 0]}}})",
        x, y, element_.c_str(), width_ * random.normal());
    return text;
  }

 private:
  double width_;
  std::string element_;
};

}  // namespace

RELIGN_PLUGIN(ToyLevel)
