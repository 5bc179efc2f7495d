// tolerances: perturbations W within the limits of a tolerance file. See README.md.
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>

#include "base/text.h"
#include "tolerance_file.h"

namespace {

using relign::Json;
using tolerances::AxisValues;
using tolerances::ElementLimits;
using tolerances::Law;
using tolerances::Pivot;
using tolerances::PoseLimits;

// Random streams of one draw. Each element has its own, so L3 gets the same deviates whichever other elements have
// limits; deviates are scaled after they are drawn, so grades differ by scale only.
constexpr std::uint64_t kStartStream = 1;
constexpr std::uint64_t kMovementStream = 2;
constexpr std::uint64_t kCureStream = 3;
constexpr std::uint64_t kDriftStream = 4;
constexpr std::uint64_t kPivotStream = 5;
constexpr std::uint64_t kBatchStream = 6;
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
    drawn["distortion"] = draw_distortion(seed, scene);
    drawn["elements"] = draw_elements(seed, scene);
    if (limits_.cure_shift) drawn["cure_shift"] = draw_pose(seed, kCureStream, *limits_.cure_shift, scene);
    if (limits_.batch) {
      const std::vector<double> measured = shares_of(limits_.batch->inspection, scene);
      drawn["batch"] = {{"size", limits_.batch->size},
                        {"cure_shift", draw_pose(seed, kBatchStream, limits_.batch->cure_shift, scene)}};
      if (!measured.empty()) drawn["batch"]["inspection"] = measured;
    }
    if (Json stage = draw_stage(seed, scene); !stage.is_null()) drawn["stage"] = std::move(stage);
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
      const bool tilts_lens = is_tilt(axis);
      const std::vector<double>& of_kind = tilts_lens ? limits.tilt_arcmin : limits.shift_um;
      const std::size_t index = tilts_lens ? tilts++ : shifts++;
      if (index >= of_kind.size())
        complain("/" + limits.key, std::string(tilts_lens ? "'tilt_arcmin'" : "'shift_um'") + " has " +
                                       std::to_string(of_kind.size()) + " numbers, none for axis '" +
                                       axis.at("name").get<std::string>() +
                                       "' of the scene; must have one per axis in " + (tilts_lens ? "degrees" : "mm"));
      const double limit = of_kind[index] / (tilts_lens ? 60 : 1000);                 // degrees or mm
      shares.push_back(limit * deviate(random, limits.law) / travel_of(axis) + 0.0);  // no negative zero
    }
    return shares;
  }

  // In shares of the travel; empty if all are 0.
  std::vector<double> shares_of(const AxisValues& values, const Json& scene) const {
    std::vector<double> shares;
    std::size_t shifts = 0, tilts = 0;
    bool any = false;
    for (const Json& axis : scene.at("axes")) {
      const bool tilts_lens = is_tilt(axis);
      const std::vector<double>& of_kind = tilts_lens ? values.tilt_arcmin : values.shift_um;
      std::size_t index = tilts_lens ? tilts++ : shifts++;
      if (tilts_lens ? values.one_tilt : values.one_shift) index = 0;
      if (index >= of_kind.size())
        complain(values.key, "of the lists of this error, the one of axes in " +
                                 std::string(tilts_lens ? "degrees" : "mm") + " has " + std::to_string(of_kind.size()) +
                                 " numbers, none for axis '" + axis.at("name").get<std::string>() +
                                 "' of the scene; must have one per axis, or a number instead of a list");
      const double per_unit = tilts_lens ? 60 : 1000;
      shares.push_back(of_kind[index] / per_unit / travel_of(axis));
      if (shares.back() > 1)
        complain(values.key, "the value for axis '" + axis.at("name").get<std::string>() +
                                 "' of the scene exceeds its travel: found " + relign::shortest(of_kind[index]) +
                                 ", allowed: up to " + relign::significant(per_unit * travel_of(axis), 4) +
                                 (tilts_lens ? " arcmin" : " um"));
      any = any || shares.back() != 0;
    }
    refuse_longer(values.key, "um", values.one_shift, values.shift_um.size(), shifts);
    refuse_longer(values.key, "arcmin", values.one_tilt, values.tilt_arcmin.size(), tilts);
    return any ? shares : std::vector<double>();
  }

  void refuse_longer(const std::string& key, const std::string& unit, bool one, std::size_t found,
                     std::size_t axes) const {
    if (!one && found > axes)
      complain(key, "the list in " + unit + " of this error has " + std::to_string(found) +
                        " numbers, but the scene has " + std::to_string(axes) +
                        (unit == "um" ? " axes in mm" : " axes in degrees"));
  }

  bool is_tilt(const Json& axis) const {
    const std::string unit = axis.at("unit");
    if (unit != "deg" && unit != "mm")
      complain("/start", "the scene's axis '" + axis.at("name").get<std::string>() + "' is in '" + unit +
                             "', but limits are in micrometres and arcminutes; use the noise level 'declared'");
    return unit == "deg";
  }

  // Null if the stage has no errors beyond the distortion.
  Json draw_stage(std::uint64_t seed, const Json& scene) const {
    const tolerances::Movement& movement = limits_.movement;
    Json stage;
    const auto add = [&stage](const char* key, const std::vector<double>& shares) {
      if (!shares.empty()) stage[key] = shares;
    };
    add("backlash", shares_of(movement.backlash, scene));
    add("repeatability", shares_of(movement.repeatability, scene));
    add("encoder_step", shares_of(movement.resolution, scene));
    std::vector<double> drift = shares_of(movement.drift, scene);
    relign::Random random(seed, kDriftStream);
    for (double& share : drift) share = share * deviate(random, limits_.law) + 0.0;
    add("drift", drift);
    if (!drift.empty()) stage["drift_seconds"] = movement.drift_seconds;
    return stage;
  }

  static double travel_of(const Json& axis) { return axis.at("upper").get<double>() - axis.at("lower").get<double>(); }

  // A stage that rotates about a point at q from the scene's pivot displaces the lens by q - R q, for small angles by
  // q x w with the rotation vector w.
  void add_pivot(std::uint64_t seed, const Json& scene, std::vector<std::vector<double>>& distortion) const {
    const std::vector<double>& limit_um = limits_.movement.pivot_um;
    if (limit_um[0] == 0 && limit_um[1] == 0 && limit_um[2] == 0) return;
    relign::Random random(seed, kPivotStream);
    std::array<double, 3> q_mm{};
    for (std::size_t i = 0; i < 3; ++i) q_mm[i] = limit_um[i] / 1000 * deviate(random, limits_.law);
    const Json& axes = scene.at("axes");
    const auto place = [&axes](const std::string& name) {
      return static_cast<std::size_t>(
          std::find_if(axes.begin(), axes.end(), [&](const Json& axis) { return axis.at("name") == name; }) -
          axes.begin());
    };
    const char* const shifts[] = {"x", "y", "z"};
    const char* const tilts[] = {"Rx", "Ry", "Rz"};
    for (std::size_t column = 0; column < axes.size(); ++column)
      if (axes[column].at("unit") == "deg" &&
          std::none_of(std::begin(tilts), std::end(tilts), [&](const char* name) { return place(name) == column; }))
        complain("/movement/pivot_um", "the rotation of axis '" + axes[column].at("name").get<std::string>() +
                                           "' of the scene is unknown; must be named Rx, Ry or Rz");
    for (std::size_t tilt = 0; tilt < 3; ++tilt) {
      const std::size_t column = place(tilts[tilt]);
      if (column == axes.size()) continue;
      const double radians = travel_of(axes[column]) * 0.017453292519943295;
      // e_tilt turns the next axis towards the one after it: (q x e_x) = (0, q_z, -q_y), and in turn.
      const std::size_t next = (tilt + 1) % 3, last = (tilt + 2) % 3;
      const std::pair<std::size_t, double> moved[] = {{next, q_mm[last]}, {last, -q_mm[next]}};
      for (const auto& [shift, mm_per_radian] : moved) {
        const std::size_t row = place(shifts[shift]);
        if (row == axes.size() && mm_per_radian != 0)
          complain("/movement/pivot_um", std::string("the offset moves the lens along '") + shifts[shift] +
                                             "', which is not an axis of the scene");
        if (row < axes.size()) distortion[row][column] += mm_per_radian * radians / travel_of(axes[row]);
      }
    }
  }

  std::vector<std::vector<double>> draw_distortion(std::uint64_t seed, const Json& scene) const {
    const std::size_t axes = scene.at("axes").size();
    relign::Random random(seed, kMovementStream);
    std::vector<std::vector<double>> distortion(axes, std::vector<double>(axes));
    for (std::size_t row = 0; row < axes; ++row)
      for (std::size_t column = 0; column < axes; ++column)
        distortion[row][column] =
            (row == column ? 1.0 : 0.0) + limits_.movement.cross_talk * deviate(random, limits_.law);
    add_pivot(seed, scene, distortion);
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
