// none: no perturbations. See README.md.
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>

namespace {

using Json = nlohmann::json;

class None final : public relign::NoiseLevel {
 public:
  explicit None(const relign::Parameters&) {}

  std::string draw(std::uint64_t /*seed*/, std::string_view scene_json) override {
    const Json scene = Json::parse(scene_json);
    const std::size_t axes = scene.at("axes").size();
    std::vector<std::vector<double>> identity(axes, std::vector<double>(axes, 0.0));
    for (std::size_t axis = 0; axis < axes; ++axis) identity[axis][axis] = 1.0;
    // A station has no nominal pose; the host ignores the start drawn for it.
    const auto start = scene.value("nominal_pose", std::vector<double>(axes, 0.5));
    return Json{{"start", start}, {"distortion", identity}, {"elements", Json::object()}}.dump();
  }
};

}  // namespace

RELIGN_PLUGIN(None)
