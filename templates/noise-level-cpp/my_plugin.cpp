// A noise level draws one instance: the start pose, the stage's distortion, the offsets of the elements.
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>

namespace {

using Json = nlohmann::json;

// Streams of one draw: each part keeps its values when another part draws more or fewer of them.
constexpr std::uint64_t kStartStream = 1;
constexpr std::uint64_t kMovementStream = 2;
constexpr std::uint64_t kFirstElementStream = 16;

class MyPlugin final : public relign::NoiseLevel {
 public:
  explicit MyPlugin(const relign::Parameters& given)
      : start_range_(given.number("start_range")),
        movement_std_(given.number("movement_std")),
        shift_mm_(given.number("shift_mm")),
        tilt_deg_(given.number("tilt_deg")) {}

  // A pure function of the seed and of what the scene says of itself.
  std::string draw(std::uint64_t seed, std::string_view scene_json) override {
    const Json scene = Json::parse(scene_json);
    const std::size_t axes = scene.at("axes").size();
    Json drawn = {{"start", start(seed, axes)}, {"distortion", distortion(seed, axes)}, {"elements", Json::object()}};
    std::uint64_t stream = kFirstElementStream;
    for (const std::string& name : scene.value("elements", std::vector<std::string>()))
      drawn["elements"][name] = offsets(relign::Random(seed, stream++));
    return drawn.dump();
  }

 private:
  // True pose, 0 to 1 along each axis.
  std::vector<double> start(std::uint64_t seed, std::size_t axes) const {
    relign::Random random(seed, kStartStream);
    std::vector<double> pose(axes);
    for (double& value : pose) value = random.uniform(0.5 - start_range_, 0.5 + start_range_);
    return pose;
  }

  // A commanded move times this matrix is the true move.
  std::vector<std::vector<double>> distortion(std::uint64_t seed, std::size_t axes) const {
    relign::Random random(seed, kMovementStream);
    std::vector<std::vector<double>> matrix(axes, std::vector<double>(axes));
    for (std::size_t row = 0; row < axes; ++row)
      for (std::size_t column = 0; column < axes; ++column)
        matrix[row][column] = (row == column ? 1.0 : 0.0) + movement_std_ * random.normal();
    return matrix;
  }

  Json offsets(relign::Random random) const {
    std::vector<double> shift_mm(3), tilt_deg(2);
    for (double& value : shift_mm) value = random.uniform(-shift_mm_, shift_mm_);
    for (double& value : tilt_deg) value = random.uniform(-tilt_deg_, tilt_deg_);
    return {{"shift_mm", shift_mm}, {"tilt_deg", tilt_deg}};
  }

  double start_range_;
  double movement_std_;
  double shift_mm_;
  double tilt_deg_;
};

}  // namespace

RELIGN_PLUGIN(MyPlugin)
