// Fits element offsets and pose to all captures, with the noise level as prior, and aligns the fitted lens. See
// README.md.
#include <relign/plugin.hpp>

#include "aligner.hpp"
#include "least_squares/learnt_once.hpp"
#include "least_squares/nominal_pose.hpp"

namespace {

using tolerance_fit::Aligner;
using tolerance_fit::Knowledge;
using tolerance_fit::Vector;

class ToleranceFit final : public relign::Agent {
 public:
  explicit ToleranceFit(const relign::Parameters& given)
      : most_offsets_(static_cast<std::size_t>(given.integer("most_offsets"))),
        far_pictures_(static_cast<std::size_t>(given.integer("far_pictures"))),
        rays_(static_cast<std::uint32_t>(given.integer("rays"))),
        stray_light_(given.boolean("stray_light")),
        settled_(given.number("settled")) {}

  void run(relign::Trial& trial) override {
    const relign::ImageView reference = trial.reference();
    relign::Model model = trial.model();
    if (reference.width() != model.width() || reference.height() != model.height())
      throw std::runtime_error("the model's images have " + std::to_string(model.width()) + " x " +
                               std::to_string(model.height()) + " pixels, the reference image has " +
                               std::to_string(reference.width()) + " x " + std::to_string(reference.height()) +
                               "; must be equal");
    const auto known = knowledge(trial);
    std::vector<double> wanted;
    for (std::size_t y = 0; y < reference.height(); ++y)
      wanted.insert(wanted.end(), reference.row(y), reference.row(y) + reference.width());
    Aligner aligner(known, std::move(model), wanted, stray_light_);
    const double reach = trial.largest_move();
    for (std::optional<relign::Observation> observation = trial.first(); observation;) {
      aligner.add(*observation);
      aligner.update();
      Vector target = aligner.target();
      if (!target.allFinite()) target = tolerance_fit::to_vector(observation->pose);
      trial.recommend(tolerance_fit::to_pose(target));
      // Near the target stay at the pose: further captures there are as informative as slightly displaced ones, and are
      // averaged before the fit.
      Vector move = Vector::Zero(target.size());
      if (aligner.distance() > settled_)
        move = (target - tolerance_fit::to_vector(observation->pose)).cwiseMax(-reach).cwiseMin(reach);
      observation = trial.move(tolerance_fit::to_pose(move));
    }
  }

 private:
  // The same for every trial of a scene and noise level: computed once per process.
  std::shared_ptr<const Knowledge> knowledge(relign::Trial& trial) const {
    constexpr std::uint64_t kDraws = 512;
    constexpr std::size_t kMaxKept = 8;
    const relign::Prior prior = trial.prior();
    std::vector<std::string> draws;
    for (std::uint64_t k = 0; k < kDraws; ++k) draws.push_back(prior.draw(k));

    tolerance_fit::Pictures pictures(trial.model());
    tolerance_fit::KnowledgeSetup setup;
    const std::string scene = trial.model().scene_json();
    setup.nominal = least_squares::nominal_pose(scene, trial.axes());
    setup.most_offsets = most_offsets_;
    setup.far_pictures = far_pictures_;
    setup.rays = rays_;

    least_squares::Origin origin;
    origin.add(scene)
        .add(static_cast<double>(most_offsets_))
        .add(static_cast<double>(far_pictures_))
        .add(static_cast<double>(rays_));
    for (const std::string& draw : draws) origin.add(draw);
    pictures.set_offsets({}, Vector(), tolerance_fit::Matrix::Zero(0, 0));
    for (const int captures : {0, 1}) origin.add(pictures.pixels(setup.nominal, Vector::Zero(0), captures));

    static least_squares::LearntOnce<Knowledge> kept(kMaxKept);
    return kept(origin,
                [&] { return tolerance_fit::learn(tolerance_fit::summarise(draws, trial.axes()), setup, pictures); });
  }

  std::size_t most_offsets_, far_pictures_;
  std::uint32_t rays_;
  bool stray_light_;
  double settled_;
};

}  // namespace

RELIGN_PLUGIN(ToleranceFit)
