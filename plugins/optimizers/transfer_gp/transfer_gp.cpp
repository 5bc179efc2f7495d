// transfer-gp: Bayesian optimisation whose prior is learnt from source instances (TransferGP, Tighineanu et al.,
// AISTATS 2022). See README.md.
#include <algorithm>
#include <cmath>
#include <relign/plugin.hpp>

#include "search.hpp"
#include "source_fit.hpp"
#include "surrogates/candidates.hpp"

namespace {

using namespace transfer_gp;

constexpr int kJointIterations = 15;
constexpr double kNear = 0.12;  // standard deviation of the first samples around the best, share of the box

class TransferGp final : public relign::Optimizer {
 public:
  explicit TransferGp(const relign::Parameters& given) : log_(given), joint_(given.text("variant") == "joint") {
    setup_.shape = given.text("kernel") == "rbf" ? Shape::rbf : Shape::matern52;
    const std::string variant(given.text("variant"));
    setup_.stacking = variant == "mhgp" ? Stacking::means : variant == "bhgp" ? Stacking::boosted : Stacking::exact;
    setup_.kappa = given.number("kappa");
    near_ = given.number("near");
    compress_ = given.boolean("compress");
    setup_.candidates = static_cast<std::size_t>(given.integer("candidates"));
  }

  void run(relign::Trial& trial) override {
    const relign::Pretraining pretraining = trial.pretraining();
    const std::optional<std::string> bytes = pretraining.load();
    SourceData data;
    if (bytes) data = SourceData::from_bytes(*bytes);
    if (!bytes) data.dimensions = trial.axes();
    if (!bytes) data.compress = compress_;
    if (data.dimensions != trial.axes())
      throw std::runtime_error("the pretraining data have " + std::to_string(data.dimensions) +
                               " axes, this trial has " + std::to_string(trial.axes()));
    if (pretraining.active()) {
      sample(trial, data);
      if (pretraining.source() + 1 == pretraining.sources()) finish(data);
      pretraining.save(data.to_bytes());
      return;
    }
    if (!bytes) log_.warn("no pretraining data: using a Gaussian process without sources");
    if (bytes && !data.finished)
      throw std::runtime_error(
          "the pretraining data are incomplete; recreate them with relign-bench plugin "
          "prepare transfer-gp --again");
    search(trial, std::move(data));
  }

 private:
  // Samples a source: the start, a Latin hypercube over the box, and the remaining steps around the best pose so far at
  // decreasing distances, where later searches need the model to be accurate.
  void sample(relign::Trial& trial, SourceData& data) const {
    const surrogates::UnitBox box(trial.box());
    relign::Random random(trial.seed());
    const auto spread = static_cast<Eigen::Index>(std::ceil((1 - near_) * trial.budget()));
    Matrix places = surrogates::latin_hypercube(random, trial.axes(), static_cast<std::size_t>(spread));
    places.conservativeResize(places.rows(), static_cast<Eigen::Index>(trial.budget()));
    std::vector<double> merits = {trial.first().merit};
    Matrix points(static_cast<Eigen::Index>(trial.axes()), places.cols() + 1);
    points.col(0) = box.to_unit(trial.first().pose);
    Eigen::Index made = 1;
    for (Eigen::Index i = 0; i < places.cols(); ++i) {
      if (i >= spread) {
        const Vector usable = surrogates::usable_merits(merits);
        const double radius =
            kNear * (1 - 0.75 * static_cast<double>(i - spread) / static_cast<double>(places.cols() - spread));
        places.col(i) = points.col(surrogates::lowest(usable, 1).front());
        for (double& coordinate : places.col(i))
          coordinate = std::clamp(coordinate + radius * random.normal(), 0.0, 1.0);
      }
      const auto observation = trial.step(box.to_pose(places.col(i)));
      if (!observation) break;
      points.col(made++) = places.col(i);
      merits.push_back(observation->merit);
    }
    data.sources.push_back({points.leftCols(made), surrogates::usable_merits(merits), {}});
  }

  void finish(SourceData& data) const {
    SourceModel model = fit_in_turn(data, setup_.shape, setup_.stacking);
    if (joint_) fit_together(data, setup_.shape, kJointIterations);
    data.finished = true;
    if (joint_) model = model_of(data, setup_.shape, setup_.stacking);
    relign::Random random(0, 1);  // the same for every trial
    data.candidates = make_candidates(model, surrogates::uniform_points(random, data.dimensions, setup_.candidates));
  }

  void search(relign::Trial& trial, SourceData data) const {
    const relign::Box limits = trial.box();
    const surrogates::UnitBox box(limits);
    Search search(std::move(data), setup_, trial.seed());
    std::optional<relign::Observation> observation = trial.first();
    Vector unit = box.to_unit(observation->pose);
    while (observation) {
      search.tell(unit, observation->merit);
      trial.recommend(limits.clamp(box.to_pose(search.best())));
      unit = search.ask();
      observation = trial.step(limits.clamp(box.to_pose(unit)));
    }
  }

  relign::Parameters log_;
  bool joint_;
  double near_ = 0;
  bool compress_ = false;
  SearchSetup setup_;
};

}  // namespace

RELIGN_PLUGIN(TransferGp)
