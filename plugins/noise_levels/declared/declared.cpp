// declared: the uncertain quantities that a scene declares. See README.md.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <relign/plugin.hpp>

#include "base/text.h"
#include "law.h"

namespace {

using declared::Law;
using declared::Quantity;
using relign::Json;

// Random streams of one draw. Each quantity has its own, so that it keeps its deviate whichever others there are.
constexpr std::uint64_t kStartStream = 1;
constexpr std::uint64_t kMovementStream = 2;
constexpr std::uint64_t kDriftStream = 4;
constexpr std::uint64_t kRowStream = 7;
constexpr std::uint64_t kFirstQuantityStream = 16;
constexpr int kMostTries = 10000;

class Declared final : public relign::NoiseLevel {
 public:
  explicit Declared(const relign::Parameters& given)
      : scale_(given.number("scale")),
        start_(given.number("start")),
        movement_std_(given.number("movement_std")),
        drift_(given.number("drift")),
        drift_seconds_(given.number("drift_seconds")) {
    if (const std::string file = given.text("laws"); !file.empty())
      laws_ = declared::read_laws(relign::JsonSource::from_file(file));
    if (const std::string file = given.text("draws"); !file.empty()) draws_ = declared::read_draws(file);
    for (const char* key : {"backlash", "repeatability", "encoder_step"})
      if (const double share = given.number(key); share > 0) stage_.push_back({key, share});
  }

  std::string draw(std::uint64_t seed, std::string_view scene_json) override {
    const relign::JsonSource source = relign::JsonSource::from_text(std::string(scene_json), "description");
    const Json& scene = source.root();
    const std::size_t axes = scene.at("axes").size();
    Json drawn = {{"start", draw_start(seed, scene, axes)}, {"distortion", draw_distortion(seed, axes)}};
    drawn["elements"] = Json::object();
    for (const auto& [name, value] : draw_quantities(seed, quantities_of(source)))
      drawn["elements"][name] = {{"value", value}};
    if (Json stage = draw_stage(seed, axes); !stage.empty()) drawn["stage"] = std::move(stage);
    return drawn.dump();
  }

 private:
  std::vector<double> draw_start(std::uint64_t seed, const Json& scene, std::size_t axes) const {
    relign::Random random(seed, kStartStream);
    auto start = scene.value("nominal_pose", std::vector<double>(axes, 0.5));
    for (double& value : start) {
      const double lower = std::clamp(value - start_ / 2, 0.0, 1 - start_);
      value = random.uniform(lower, lower + start_);
    }
    return start;
  }

  std::vector<std::vector<double>> draw_distortion(std::uint64_t seed, std::size_t axes) const {
    relign::Random random(seed, kMovementStream);
    std::vector<std::vector<double>> distortion(axes, std::vector<double>(axes));
    for (std::size_t row = 0; row < axes; ++row)
      for (std::size_t column = 0; column < axes; ++column)
        distortion[row][column] = (row == column ? 1.0 : 0.0) + movement_std_ * random.normal();
    return distortion;
  }

  Json draw_stage(std::uint64_t seed, std::size_t axes) const {
    Json stage = Json::object();
    for (const auto& [key, share] : stage_) stage[key] = std::vector<double>(axes, share);
    if (drift_ == 0) return stage;
    relign::Random random(seed, kDriftStream);
    std::vector<double> drift(axes);
    for (double& share : drift) share = std::clamp(drift_ * random.normal(), -1.0, 1.0);
    stage["drift"] = drift;
    stage["drift_seconds"] = drift_seconds_;
    return stage;
  }

  // The scene's quantities with the laws of the file.
  std::vector<Quantity> quantities_of(const relign::JsonSource& scene) const {
    std::vector<Quantity> quantities = declared::declared_by(scene);
    for (const Quantity& own : laws_.quantities) at(quantities, own.name, "the file of laws").law = own.law;
    return quantities;
  }

  static Quantity& at(std::vector<Quantity>& quantities, const std::string& name, const std::string& what) {
    std::vector<std::string> names;
    for (Quantity& one : quantities) {
      if (one.name == name) return one;
      names.push_back(one.name);
    }
    throw std::invalid_argument(what + " has '" + name + "', but the scene declares " +
                                (names.empty() ? "no uncertain quantity" : "only: " + relign::join(names, ", ")));
  }

  std::vector<std::pair<std::string, double>> draw_quantities(std::uint64_t seed,
                                                              std::vector<Quantity> quantities) const {
    std::vector<std::pair<std::string, double>> drawn;
    std::vector<relign::Random> random;
    for (std::size_t i = 0; i < quantities.size(); ++i) random.emplace_back(seed, kFirstQuantityStream + i);
    const Eigen::MatrixXd mixed = correlated(quantities);
    for (int tries = 0; tries < kMostTries; ++tries) {
      Eigen::VectorXd deviates(static_cast<Eigen::Index>(quantities.size()));
      for (std::size_t i = 0; i < quantities.size(); ++i)
        deviates[static_cast<Eigen::Index>(i)] =
            quantities[i].law.normal ? random[i].normal() : random[i].uniform(-1, 1);
      deviates = mixed * deviates;
      drawn.clear();
      bool inside = true;
      for (std::size_t i = 0; i < quantities.size(); ++i) {
        const Law& law = quantities[i].law;
        const double value = law.middle() + deviates[static_cast<Eigen::Index>(i)] *
                                                (law.normal ? law.sigma : (law.upper - law.lower) / 2);
        inside = inside && value >= law.lower && value <= law.upper;
        drawn.emplace_back(quantities[i].name, law.middle() + scale_ * (value - law.middle()) + 0.0);
      }
      if (inside) return measured(seed, std::move(drawn), quantities);
    }
    throw std::invalid_argument("of " + std::to_string(kMostTries) +
                                " draws none is within the limits of the normal laws; widen them");
  }

  // The factor by which independent deviates become correlated.
  Eigen::MatrixXd correlated(std::vector<Quantity>& quantities) const {
    const auto size = static_cast<Eigen::Index>(quantities.size());
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(size, size);
    for (const auto& [names, value] : laws_.correlations) {
      const Quantity& a = at(quantities, names.first, "a correlation");
      const Quantity& b = at(quantities, names.second, "a correlation");
      if (!a.law.normal || !b.law.normal)
        throw std::invalid_argument("the correlation of '" + a.name + "' and '" + b.name +
                                    "' needs normal laws of both");
      matrix(&a - quantities.data(), &b - quantities.data()) = matrix(&b - quantities.data(), &a - quantities.data()) =
          value;
    }
    const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
    if (factor.info() != Eigen::Success)
      throw std::invalid_argument("the correlations contradict each other: their matrix is not positive definite");
    return factor.matrixL();
  }

  // A row of the file of draws in the place of the laws of its quantities.
  std::vector<std::pair<std::string, double>> measured(std::uint64_t seed,
                                                       std::vector<std::pair<std::string, double>> drawn,
                                                       std::vector<Quantity>& quantities) const {
    if (draws_.rows.empty()) return drawn;
    relign::Random random(seed, kRowStream);
    const std::vector<double>& row = draws_.rows[std::min(
        draws_.rows.size() - 1, static_cast<std::size_t>(random.uniform() * static_cast<double>(draws_.rows.size())))];
    for (std::size_t i = 0; i < draws_.names.size(); ++i) {
      const Quantity& of = at(quantities, draws_.names[i], "the file of draws");
      drawn[static_cast<std::size_t>(&of - quantities.data())].second =
          of.law.middle() + scale_ * (row[i] - of.law.middle()) + 0.0;
    }
    return drawn;
  }

  double scale_, start_, movement_std_, drift_, drift_seconds_;
  declared::Laws laws_;
  declared::Draws draws_;
  std::vector<std::pair<const char*, double>> stage_;
};

}  // namespace

RELIGN_PLUGIN(Declared)
