// rho: the distribution of the perturbations W in the paper's study. See README.md.
#include <cmath>
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>

namespace {

using Json = nlohmann::json;

// Random streams of one draw. Each element has its own, so L3 gets the same deviates whichever other elements are
// offset; deviates are scaled after they are drawn, so levels differ by scale only.
constexpr std::uint64_t kStartStream = 1;
constexpr std::uint64_t kMovementStream = 2;
constexpr std::uint64_t kFirstElementStream = 16;

class Rho final : public relign::NoiseLevel {
 public:
  explicit Rho(const relign::Parameters& given)
      : level_(given.number("level")),
        movement_std_(given.number("movement_std")),
        package_form_(given.text("movement_form") == "package"),
        elements_(given.text("elements")),
        shift_std_mm_(given.number("shift_std_mm")),
        shifts_z_(given.text("shift_axes") == "xyz"),
        tilt_std_deg_(given.number("tilt_std_deg")) {}

  std::string draw(std::uint64_t seed, std::string_view scene_json) override {
    const Json scene = Json::parse(scene_json);
    const std::size_t axes = scene.at("axes").size();
    const auto names = scene.value("elements", std::vector<std::string>{});
    Json drawn;
    drawn["start"] = draw_start(seed, axes);
    drawn["distortion"] = draw_distortion(seed, axes);
    drawn["elements"] = Json::object();
    for (const std::size_t index : chosen_elements(names)) drawn["elements"][names[index]] = draw_offsets(seed, index);
    return drawn.dump();
  }

 private:
  static std::vector<double> draw_start(std::uint64_t seed, std::size_t axes) {
    relign::Random random(seed, kStartStream);
    std::vector<double> start(axes);
    for (double& value : start) value = random.uniform();
    return start;
  }

  std::vector<std::vector<double>> draw_distortion(std::uint64_t seed, std::size_t axes) const {
    relign::Random random(seed, kMovementStream);
    std::vector<std::vector<double>> distortion(axes, std::vector<double>(axes));
    for (std::size_t row = 0; row < axes; ++row) {
      double sum = 0;
      for (std::size_t column = 0; column < axes; ++column) {
        const double eps = movement_std_ * random.normal();
        distortion[row][column] = (row == column ? 1.0 : 0.0) + (package_form_ ? std::fabs(eps) : eps);
        sum += distortion[row][column];
      }
      if (package_form_)
        for (double& value : distortion[row]) value /= sum;
    }
    return distortion;
  }

  Json draw_offsets(std::uint64_t seed, std::size_t element) const {
    relign::Random random(seed, kFirstElementStream + element);
    double deviates[5];  // shift x, y, z, tilt x, y: always drawn, even if not used
    for (double& deviate : deviates) deviate = random.normal();
    const double shift_mm = shift_std_mm_ * level_;
    const double tilt_deg = tilt_std_deg_ * level_;
    const auto scaled = [](double scale, double deviate) { return scale == 0 ? 0.0 : scale * deviate; };
    return {{"shift_mm",
             {scaled(shift_mm, deviates[0]), scaled(shift_mm, deviates[1]),
              scaled(shifts_z_ ? shift_mm : 0.0, deviates[2])}},
            {"tilt_deg", {scaled(tilt_deg, deviates[3]), scaled(tilt_deg, deviates[4])}}};
  }

  // Indices of the elements to offset in the scene's list.
  std::vector<std::size_t> chosen_elements(const std::vector<std::string>& names) const {
    std::vector<std::size_t> chosen;
    const std::string last = "last:";
    if (elements_.compare(0, last.size(), last) == 0) {
      const std::size_t count = read_count(elements_.substr(last.size()));
      // Level 0 has no offsets and accepts every scene.
      if (count > names.size() && level_ > 0)
        throw std::invalid_argument("parameter 'elements': found '" + elements_ + "', the scene has only " +
                                    std::to_string(names.size()) + " (" + joined(names) +
                                    "); use rho0, which has no offsets");
      for (std::size_t index = names.size() - std::min(count, names.size()); index < names.size(); ++index)
        chosen.push_back(index);
      return chosen;
    }
    std::size_t begin = 0;
    while (begin <= elements_.size()) {
      const std::size_t comma = std::min(elements_.find(',', begin), elements_.size());
      const std::string name = trimmed(elements_.substr(begin, comma - begin));
      const auto found = std::find(names.begin(), names.end(), name);
      if (found == names.end())
        throw std::invalid_argument("parameter 'elements': the scene has no element '" + name +
                                    "'; it has: " + joined(names));
      const auto index = static_cast<std::size_t>(found - names.begin());
      if (std::find(chosen.begin(), chosen.end(), index) != chosen.end())
        throw std::invalid_argument("parameter 'elements': duplicate element '" + name + "'");
      chosen.push_back(index);
      begin = comma + 1;
    }
    return chosen;
  }

  std::size_t read_count(const std::string& digits) const {
    const bool fits =
        !digits.empty() && digits.size() <= 4 && digits.find_first_not_of("0123456789") == std::string::npos;
    if (!fits)
      throw std::invalid_argument("parameter 'elements': found '" + elements_ +
                                  "', must be last:K with a non-negative integer K");
    return static_cast<std::size_t>(std::stoul(digits));
  }

  static std::string trimmed(const std::string& text) {
    const auto begin = text.find_first_not_of(' ');
    return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(' ') - begin + 1);
  }

  static std::string joined(const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
    return text.empty() ? "none" : text;
  }

  double level_;
  double movement_std_;
  bool package_form_;
  std::string elements_;
  double shift_std_mm_;
  bool shifts_z_;
  double tilt_std_deg_;
};

}  // namespace

RELIGN_PLUGIN(Rho)
