// Fits the lens in the machine, within the level's tolerances, and aligns it by the fitted model. See README.md.
#include <deque>
#include <mutex>
#include <relign/plugin.hpp>

#include "aligner.hpp"

namespace {

using tolerance_fit::Aligner;
using tolerance_fit::Knowledge;
using tolerance_fit::Vector;

// Texts and pixels in 64 bits (FNV-1a).
class Fingerprint {
 public:
  void add(std::string_view bytes) {
    for (const char byte : bytes) value_ = (value_ ^ static_cast<unsigned char>(byte)) * 0x100000001b3ULL;
  }
  void add(const std::vector<float>& pixels) {
    add({reinterpret_cast<const char*>(pixels.data()), pixels.size() * sizeof(float)});
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325ULL;
};

class ToleranceFit final : public relign::Agent {
 public:
  explicit ToleranceFit(const relign::Parameters& given)
      : most_offsets_(static_cast<std::size_t>(given.integer("most_offsets"))),
        far_pictures_(static_cast<std::size_t>(given.integer("far_pictures"))),
        pictures_(static_cast<int>(given.integer("pictures"))),
        settled_(given.number("settled")) {}

  void run(relign::Conversation& talk) override {
    const relign::ImageView reference = talk.reference();
    relign::Model model = talk.model();
    if (reference.width() != model.width() || reference.height() != model.height())
      throw std::runtime_error("the model's pictures are of another size than the captures");
    const auto known = knowledge(talk);
    std::vector<double> wanted;
    for (std::size_t y = 0; y < reference.height(); ++y)
      wanted.insert(wanted.end(), reference.row(y), reference.row(y) + reference.width());
    Aligner aligner(known, std::move(model), wanted, pictures_);
    const double reach = talk.largest_move();
    for (std::optional<relign::Observation> seen = talk.first(); seen;) {
      aligner.add(*seen);
      aligner.update();
      Vector target = aligner.target();
      if (!target.allFinite()) target = tolerance_fit::to_vector(seen->pose);
      talk.recommend(tolerance_fit::to_pose(target));
      // More captures where it stands tell as much as captures a little beside, and are fitted as one.
      Vector move = Vector::Zero(target.size());
      if (aligner.distance() > settled_)
        move = (target - tolerance_fit::to_vector(seen->pose)).cwiseMax(-reach).cwiseMin(reach);
      seen = talk.move(tolerance_fit::to_pose(move));
    }
  }

 private:
  // The same for every trial of a scene and level: learnt once in a process.
  std::shared_ptr<const Knowledge> knowledge(relign::Conversation& talk) const {
    constexpr std::uint64_t kDraws = 512;
    constexpr std::size_t kMostKept = 8;
    const relign::Prior prior = talk.prior();
    std::vector<std::string> draws;
    for (std::uint64_t k = 0; k < kDraws; ++k) draws.push_back(prior.draw(k));

    tolerance_fit::Pictures pictures(talk.model());
    tolerance_fit::KnowledgeSetup setup;
    setup.nominal = Vector::Constant(static_cast<Eigen::Index>(talk.axes()), 0.5);
    const std::string scene = talk.model().scene_json();
    const auto nominal = nlohmann::json::parse(scene).value("nominal_pose", relign::Pose());
    if (nominal.size() == talk.axes()) setup.nominal = tolerance_fit::to_vector(nominal);
    setup.most_offsets = most_offsets_;
    setup.far_pictures = far_pictures_;

    // Pictures belong to it: a scene does not describe all that its noise depends on.
    Fingerprint print;
    print.add(scene);
    for (const std::string& draw : draws) print.add(draw);
    print.add(std::to_string(most_offsets_) + " " + std::to_string(far_pictures_));
    pictures.set_offsets({}, Vector(), tolerance_fit::Matrix::Zero(0, 0));
    for (const int captures : {0, 1}) print.add(pictures.pixels(setup.nominal, Vector::Zero(0), captures));

    static std::mutex mutex;
    static std::deque<std::pair<std::uint64_t, std::shared_ptr<const Knowledge>>> kept;
    const std::lock_guard<std::mutex> hold(mutex);  // whoever waits here most likely waits for the same
    for (const auto& [key, known] : kept)
      if (key == print.value()) return known;
    auto learnt = std::make_shared<const Knowledge>(
        tolerance_fit::learn(tolerance_fit::summarise(draws, talk.axes()), setup, pictures));
    kept.emplace_front(print.value(), learnt);
    if (kept.size() > kMostKept) kept.pop_back();
    return learnt;
  }

  std::size_t most_offsets_, far_pictures_;
  int pictures_;
  double settled_;
};

}  // namespace

RELIGN_PLUGIN(ToleranceFit)
