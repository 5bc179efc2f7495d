// tolerances: perturbations W within the limits of a tolerance file. See README.md.
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

// Random streams of one draw. Each element has its own, so L3 gets the same deviates whichever other elements have
// limits; deviates are scaled after they are drawn, so grades differ by scale only.
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
  // A value from -1 to 1.
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
    // A station has no nominal pose; the host ignores the start drawn for it.
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
      const bool tilts_lens = axis.at("unit") == "deg";
      const std::vector<double>& of_kind = tilts_lens ? limits.tilt_arcmin : limits.shift_um;
      const std::size_t index = tilts_lens ? tilts++ : shifts++;
      if (index >= of_kind.size())
        complain("/" + limits.key, std::string(tilts_lens ? "'tilt_arcmin'" : "'shift_um'") + " has " +
                                       std::to_string(of_kind.size()) + " numbers, none for axis '" +
                                       axis.at("name").get<std::string>() +
                                       "' of the scene; must have one per axis in " + (tilts_lens ? "degrees" : "mm"));
      const double limit = of_kind[index] / (tilts_lens ? 60 : 1000);  // degrees or mm
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
        complain("/elements/" + named.first, "the scene has no element '" + named.first +
                                                 "'; it has: " + (names.empty() ? "none" : relign::join(names, ", ")) +
                                                 " ('*' for all)");
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
    const auto within = [&](double limit) {  // always draws, even if the limit is 0
      const double value = limit * deviate(random, limits_.law);
      return limit == 0 ? 0.0 : value;
    };
    std::vector<double> shift_mm, tilt_deg;
    for (const double limit : limits.shift_um) shift_mm.push_back(within(limit / 1000));
    for (const double limit : limits.tilt_arcmin) tilt_deg.push_back(within(limit / 60));
    if (limits.pivot != Pivot::scene && (limits.tilt_arcmin[0] != 0 || limits.tilt_arcmin[1] != 0)) {
      // A rotation about a point at distance d behind the scene's pivot is one about that pivot plus the shift
      // d - Rx Ry d.
      const double d = behind_scene_pivot(name, limits.pivot, scene);
      const relign::SineCosine x = relign::portable_sine_cosine(tilt_deg[0]);
      const relign::SineCosine y = relign::portable_sine_cosine(tilt_deg[1]);
      shift_mm[0] -= d * y.sine;
      shift_mm[1] += d * x.sine * y.cosine;
      shift_mm[2] += d * (1 - x.cosine * y.cosine);
    }
    return {{"shift_mm", shift_mm}, {"tilt_deg", tilt_deg}};
  }

  // Distance of the pivot behind the scene's pivot, in mm.
  double behind_scene_pivot(const std::string& name, Pivot pivot, const Json& scene) const {
    const Json geometry = scene.value("geometry", Json::object());
    const Json elements = geometry.value("elements", Json::object());
    if (!geometry.contains("pivot_z_mm") || !elements.contains(name))
      complain(limits_.named.count(name) ? "/elements/" + name : "/elements/*",
               "the scene's description has no 'geometry' of element '" + name +
                   "', so its own pivot is unknown; set \"pivot\": \"scene\"");
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
