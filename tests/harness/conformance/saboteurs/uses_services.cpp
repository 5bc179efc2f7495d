// For tests of the conformance checks: sound, and uses every service; checks that answers match the header.
#include <cmath>

#include "sound.h"

namespace {

void require(bool true_thing, const char* sentence) {
  if (!true_thing) throw std::logic_error(sentence);
}

template <class Body>
bool refused(Body&& body) {
  try {
    body();
  } catch (const std::invalid_argument&) {
    return true;
  }
  return false;
}

class Saboteur final : public saboteur::Sound {
  using Sound::Sound;

  void before_first(relign::Trial& trial) override {
    const relign::ImageView wanted = trial.reference();
    const relign::Measures measures = trial.measures();  // of the first capture, before first() was called
    const double blurred = measures.measure("mtf", R"({"cycles_per_pixel": 0.1})");
    require(blurred > 0 && blurred < 1, "the edge has no modulation");
    require(measures.list().find("\"mtf\"") != std::string::npos, "the measures have no names");
    require(refused([&] { measures.measure("mtf"); }), "a missing argument was not refused");
    const relign::Observation start = trial.first();
    require(start.image().width() == wanted.width() && start.image().at(0, 0) < start.image().at(39, 0), "no edge");
    sharpness_at_start_ = measures.measure("sharpness");

    require(trial.prior().draw(3) == trial.prior().draw(3) && trial.prior().draw(3) != trial.prior().draw(4),
            "a draw does not depend on its number alone");
    require(trial.prior().draw(3).find("\"distortion\"") != std::string::npos, "a draw has no distortion");

    const relign::Model model = trial.model();
    require(model.width() == wanted.width() && model.scene_json().find("\"L4\"") != std::string::npos, "no design");
    const relign::Pose middle(trial.axes(), 0.5);
    const relign::ModelLens perfect = model.mount("{}");
    const relign::ModelLens bent = model.mount(R"({"L4": {"shift_mm": [0.3, 0, 0]}})");
    require(perfect.capture(middle, 1) == perfect.capture(middle, 1) &&
                perfect.capture(middle, 1) != perfect.capture(middle, 2),
            "a capture does not depend on its seed alone");
    require(perfect.noise_free(middle) && *perfect.noise_free(middle) != *bent.noise_free(middle),
            "offsets have no effect");
    require(refused([&] { model.mount(R"({"L9": {}})"); }), "an unknown element was not refused");
    require(refused([&] { perfect.capture(relign::Pose(trial.axes(), std::nan("")), 1); }), "NaN was not refused");
    require(refused([&] { trial.run("now", 1); }), "an unknown parameter was not refused");
    require(refused([&] { trial.run("then", 0); }), "no steps were not refused");
  }

  void before_step(relign::Trial& trial, const relign::Observation& seen, relign::Pose& pose) override {
    require(seen.image().width() == trial.reference().width(), "another image than the reference");
    if (seen.step % 8 != 5) return;
    const unsigned most = 2 * static_cast<unsigned>(trial.axes()) + (seen.step == 5 ? 1 : 0);
    const relign::RunOutcome outcome = trial.run("then", most);
    stopped_ = !outcome.last;
    if (stopped_) return;
    require(outcome.steps <= most && outcome.last->step > seen.step,
            "the inner algorithm took more steps than allowed");
    require(outcome.best && outcome.recommendation && outcome.best->pose == *outcome.recommendation, "no best pose");
    require(outcome.finished || outcome.steps == most || trial.budget() == outcome.last->step,
            "it stopped without a reason");
    trial.recommend(*outcome.recommendation);
    pose = *outcome.recommendation;
  }

  void after_last(relign::Trial& trial) override {
    require(!std::isnan(sharpness_at_start_) && !std::isnan(trial.measures().measure("contrast")), "a measure is NaN");
  }

  double sharpness_at_start_ = std::nan("");
};

}  // namespace

RELIGN_PLUGIN(Saboteur)
