// tolerances: variances W from limits that a user writes. See README.md.
#include <cmath>
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>

#include "base/text.h"
#include "tolerance_file.h"

namespace {

using relign::Json;
using tolerances::ElementLimits;
using tolerances::Law;
using tolerances::Pivot;
using tolerances::PoseLimits;

// Streams of one draw. Each element has its own, so that L3 gets the same deviates whichever other elements have
// limits; deviates are scaled after they are drawn, so that grades differ by scale only.
constexpr std::uint64_t kStartStream = 1;
constexpr std::uint64_t kMovementStream = 2;
constexpr std::uint64_t kCureStream = 3;
constexpr std::uint64_t kFirstElementStream = 16;

class Tolerances final : public relign::NoiseLevel {
 public:
  explicit Tolerances(const relign::Parameters& given)
      : source_(relign::JsonSource::from_file(given.text("tolerances"))),
        limits_(tolerances::read_tolerances(source_)) {}

  std::string draw(std::uint64_t seed, std::string_view scene_json) override {
    const Json scene = Json::parse(scene_json);
    Json drawn;
    drawn["start"] = draw_start(seed, scene);
    drawn["distortion"] = draw_distortion(seed, scene.at("axes").size());
    drawn["elements"] = draw_elements(seed, scene);
    if (limits_.cure_shift) drawn["cure_shift"] = draw_pose(seed, kCureStream, *limits_.cure_shift, scene);
    return drawn.dump();
  }

 private:
  // A value within plus and minus 1.
  double deviate(relign::Random& random, Law law) const {
    if (law == Law::uniform) return random.uniform(-1, 1);
    double normal = 0;
    do {
      normal = random.normal();
    } while (std::fabs(normal) > limits_.sigmas);
    return normal / limits_.sigmas;
  }

  std::vector<double> draw_start(std::uint64_t seed, const Json& scene) const {
    const std::vector<double> shares = draw_pose(seed, kStartStream, limits_.start, scene);
    // A station names no nominal pose, and its start is its own.
    auto start = scene.value("nominal_pose", std::vector<double>(shares.size(), 0.5));
    for (std::size_t axis = 0; axis < shares.size(); ++axis)
      start.at(axis) = std::clamp(start.at(axis) + shares[axis], 0.0, 1.0);
    return start;
  }

  // A displacement of the whole lens, in shares of the travel.
  std::vector<double> draw_pose(std::uint64_t seed, std::uint64_t stream, const PoseLimits& limits,
                                const Json& scene) const {
    relign::Random random(seed, stream);
    std::vector<double> shares;
    std::size_t shifts = 0, tilts = 0;
    for (const Json& axis : scene.at("axes")) {
      const bool turns = axis.at("unit") == "deg";
      const std::vector<double>& of_kind = turns ? limits.tilt_arcmin : limits.shift_um;
      const std::size_t place = turns ? tilts++ : shifts++;
      if (place >= of_kind.size())
        complain("/" + limits.key, std::string(turns ? "\"tilt_arcmin\"" : "\"shift_um\"") + " has " +
                                       std::to_string(of_kind.size()) + " numbers, none for the axis \"" +
                                       axis.at("name").get<std::string>() + "\" of this scene: one for each axis in " +
                                       (turns ? "degrees" : "mm") + " is needed");
      const double limit = of_kind[place] / (turns ? 60 : 1000);  // degrees or mm
      const double travel = axis.at("upper").get<double>() - axis.at("lower").get<double>();
      shares.push_back(limit * deviate(random, limits.law) / travel + 0.0);  // no negative zero
    }
    return shares;
  }

  std::vector<std::vector<double>> draw_distortion(std::uint64_t seed, std::size_t axes) const {
    relign::Random random(seed, kMovementStream);
    std::vector<std::vector<double>> distortion(axes, std::vector<double>(axes));
    for (std::size_t row = 0; row < axes; ++row)
      for (std::size_t column = 0; column < axes; ++column)
        distortion[row][column] = (row == column ? 1.0 : 0.0) + limits_.cross_talk * deviate(random, limits_.law);
    return distortion;
  }

  Json draw_elements(std::uint64_t seed, const Json& scene) const {
    const auto names = scene.value("elements", std::vector<std::string>{});
    for (const auto& named : limits_.named)
      if (std::find(names.begin(), names.end(), named.first) == names.end())
        complain("/elements/" + named.first, "the scene has no element \"" + named.first +
                                                 "\"; it has: " + (names.empty() ? "none" : relign::join(names, ", ")) +
                                                 " (\"*\" stands for all)");
    Json drawn = Json::object();
    for (std::size_t index = 0; index < names.size(); ++index) {
      const auto own = limits_.named.find(names[index]);
      if (own == limits_.named.end() && !limits_.every) continue;
      const ElementLimits& limits = own == limits_.named.end() ? *limits_.every : own->second;
      drawn[names[index]] = draw_offsets(seed, index, names[index], limits, scene);
    }
    return drawn;
  }

  Json draw_offsets(std::uint64_t seed, std::size_t index, const std::string& name, const ElementLimits& limits,
                    const Json& scene) const {
    relign::Random random(seed, kFirstElementStream + index);
    const auto within = [&](double limit) {  // drawn also where the limit is 0
      const double value = limit * deviate(random, limits_.law);
      return limit == 0 ? 0.0 : value;
    };
    std::vector<double> shift_mm, tilt_deg;
    for (const double limit : limits.shift_um) shift_mm.push_back(within(limit / 1000));
    for (const double limit : limits.tilt_arcmin) tilt_deg.push_back(within(limit / 60));
    if (limits.pivot != Pivot::scene && (limits.tilt_arcmin[0] != 0 || limits.tilt_arcmin[1] != 0)) {
      // Turning about a point d behind the scene's pivot is turning about the scene's, and d - Rx Ry d beside it.
      const double d = behind_scene_pivot(name, limits.pivot, scene);
      const relign::SineCosine x = relign::portable_sine_cosine(tilt_deg[0]);
      const relign::SineCosine y = relign::portable_sine_cosine(tilt_deg[1]);
      shift_mm[0] -= d * y.sine;
      shift_mm[1] += d * x.sine * y.cosine;
      shift_mm[2] += d * (1 - x.cosine * y.cosine);
    }
    return {{"shift_mm", shift_mm}, {"tilt_deg", tilt_deg}};
  }

  // How far the pivot lies behind the scene's, in mm.
  double behind_scene_pivot(const std::string& name, Pivot pivot, const Json& scene) const {
    const Json geometry = scene.value("geometry", Json::object());
    const Json elements = geometry.value("elements", Json::object());
    if (!geometry.contains("pivot_z_mm") || !elements.contains(name))
      complain(limits_.named.count(name) ? "/elements/" + name : "/elements/*",
               "the scene does not say where \"" + name +
                   "\" stands (\"geometry\" in its description), so that it cannot be turned about a point of its "
                   "own: write \"pivot\": \"scene\"");
    const Json& element = elements.at(name);
    const double front = element.at("front_z_mm"), back = element.at("back_z_mm");
    const double own = pivot == Pivot::own_front ? front : pivot == Pivot::own_back ? back : 0.5 * (front + back);
    return own - geometry.at("pivot_z_mm").get<double>();
  }

  [[noreturn]] void complain(const std::string& pointer, const std::string& message) const {
    throw std::invalid_argument(source_.problem(pointer, message).to_string());
  }

  relign::JsonSource source_;
  tolerances::Tolerances limits_;
};

}  // namespace

RELIGN_PLUGIN(Tolerances)
