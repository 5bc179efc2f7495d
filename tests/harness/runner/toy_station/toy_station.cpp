// A station with known values: two axes of 2 mm, hidden distortion and start, 0.25 s per move, 0.5 s per capture.
#include <cmath>
#include <relign/plugin.hpp>

namespace {

constexpr unsigned kWidth = 12;
constexpr unsigned kHeight = 8;

void draw_spot(double x, double y, float* pixels) {
  for (unsigned row = 0; row < kHeight; ++row)
    for (unsigned column = 0; column < kWidth; ++column) {
      const double dx = (column + 0.5) / kWidth - x;
      const double dy = (row + 0.5) / kHeight - y;
      pixels[row * kWidth + column] = static_cast<float>(std::exp(-20 * (dx * dx + dy * dy)));
    }
}

class ToyStation final : public relign::Station {
 public:
  explicit ToyStation(const relign::Parameters& given)
      : fails_at_move_(given.integer("fails_at_move")), reference_(std::size_t{kWidth} * kHeight) {
    draw_spot(0.5, 0.5, reference_.data());
  }

  std::string describe() override {
    return R"({"name": "toy station", "owns_stage": true, "truth": false, "image": {"width": 12, "height": 8, "white": 1},
      "axes": [{"name": "x", "unit": "mm", "lower": -1, "upper": 1}, {"name": "y", "unit": "mm", "lower": -1, "upper": 1}]})";
  }
  relign_image reference() override {
    relign_image image{};
    image.struct_size = sizeof image;
    image.sample_format = RELIGN_SAMPLE_FLOAT32;
    image.width = kWidth;
    image.height = kHeight;
    image.channels = 1;
    image.pixels = reference_.data();
    image.row_stride_bytes = kWidth * sizeof(float);
    return image;
  }

  void begin(std::uint64_t seed) override {
    ++begins;
    moves_ = 0;
    relign::Random random(seed);
    x_ = random.uniform();
    y_ = random.uniform();
  }
  Moved move_by(const relign::Pose& delta) override {
    if (++moves_ == fails_at_move_ && begins % 2 == 0)
      throw std::runtime_error("the hexapod lost its reference in trial " + std::to_string(begins));
    Moved made;
    made.machine_seconds = 0.25;
    made.moved = {along(x_, delta[0], 0, made), along(y_, delta[1], 1, made)};
    return made;
  }
  double capture(float* pixels) override {
    draw_spot(x_ + 0.05 * y_, y_ - 0.05 * x_, pixels);
    return 0.5;
  }

 private:
  static double along(double& place, double delta, unsigned axis, Moved& made) {
    const double before = place;
    place += delta;
    if (place < 0) made.limits_low |= std::uint64_t{1} << axis;
    if (place > 1) made.limits_high |= std::uint64_t{1} << axis;
    if (place >= 0 && place <= 1) return delta;
    place = std::min(1.0, std::max(0.0, place));
    return place - before;
  }

  inline static unsigned begins = 0;  // one station, for any number of objects
  std::int64_t fails_at_move_;
  std::int64_t moves_ = 0;
  std::vector<float> reference_;
  double x_ = 0;
  double y_ = 0;
};

}  // namespace

RELIGN_PLUGIN(ToyStation)
