// relign/plugin.hpp without any host of ours: the tables it makes, called as a host would.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <relign/plugin.hpp>

#include "contract/fake_trial.h"

namespace relign {
namespace {

using test::FakeSetup;
using test::FakeTrial;
using testing::ElementsAre;
using testing::HasSubstr;

// Just enough of a host: one number, one text, and the last sentence of fail.
struct SmallHost {
  SmallHost() {
    host.struct_size = sizeof host;
    host.threads = 3;
    host.context = this;
    host.plugin_folder = to_text("/some/folder");
    host.fail = [](void* self, relign_text text) {
      static_cast<SmallHost*>(self)->failure = std::string(to_view(text));
    };
    host.log = [](void* self, std::int32_t, relign_text text) {
      static_cast<SmallHost*>(self)->logged = std::string(to_view(text));
    };
    parameters.struct_size = sizeof parameters;
    parameters.json = to_text("{\"stride\":0.5}");
    parameters.number = [](void*, relign_text name, double* value) -> relign_status {
      if (to_view(name) != "stride") return RELIGN_BAD_ARGUMENT;
      *value = 0.5;
      return RELIGN_OK;
    };
    parameters.integer = [](void*, relign_text, std::int64_t*) -> relign_status { return RELIGN_BAD_ARGUMENT; };
    parameters.boolean = [](void*, relign_text name, std::int32_t* value) -> relign_status {
      if (to_view(name) != "eager") return RELIGN_BAD_ARGUMENT;
      *value = 1;
      return RELIGN_OK;
    };
    parameters.text = [](void*, relign_text name, relign_text* value) -> relign_status {
      if (to_view(name) != "mode") return RELIGN_BAD_ARGUMENT;
      *value = to_text("fast");
      return RELIGN_OK;
    };
  }
  relign_host host{};
  relign_parameters parameters{};
  std::string failure;
  std::string logged;
};

// Creates, runs and destroys as a host does; returns the status of what came last.
template <class Made>
relign_status run(SmallHost& host, const FakeTrial& trial) {
  const auto* table =
      static_cast<const relign_algorithm_interface*>(border::get_interface<Made>(to_text(RELIGN_ALGORITHM_INTERFACE)));
  relign_algorithm* made = nullptr;
  const relign_status created = table->create(&host.host, &host.parameters, &made);
  if (created != RELIGN_OK) return created;
  const relign_status status = table->run(made, &trial.handle());
  table->destroy(made);
  return status;
}

FakeSetup line_setup() {
  FakeSetup setup;
  setup.axes = 2;
  setup.budget = 4;
  setup.merit = [](const test::Pose& pose, std::uint32_t) { return 1 + pose[0]; };
  return setup;
}

TEST(Parameters, GivesValuesAndWhatTheHostOffers) {
  SmallHost host;
  const Parameters given(&host.host, &host.parameters);
  EXPECT_EQ(given.number("stride"), 0.5);
  EXPECT_TRUE(given.boolean("eager"));
  EXPECT_EQ(given.text("mode"), "fast");
  EXPECT_EQ(given.json(), "{\"stride\":0.5}");
  EXPECT_EQ(given.plugin_folder(), "/some/folder");
  EXPECT_EQ(given.cache_folder(), "");
  EXPECT_EQ(given.threads(), 3u);
  given.warn("careful");
  EXPECT_EQ(host.logged, "careful");
}

TEST(Parameters, NamesAWrongNameAndType) {
  SmallHost host;
  const Parameters given(&host.host, &host.parameters);
  const auto text_of = [](auto&& body) {
    try {
      body();
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  EXPECT_EQ(text_of([&] { given.number("strid"); }), "the manifest declares no parameter 'strid' of type number");
  EXPECT_EQ(text_of([&] { given.integer("stride"); }), "the manifest declares no parameter 'stride' of type integer");
  EXPECT_EQ(text_of([&] { given.boolean("mode"); }), "the manifest declares no parameter 'mode' of type boolean");
  EXPECT_EQ(text_of([&] { given.text("eager"); }), "the manifest declares no parameter 'eager' of type text");
}

TEST(Box, ClampsAndHasACentre) {
  const Box box{{0, -1}, {1, 3}};
  EXPECT_THAT(box.clamp({2, -2}), ElementsAre(1, -1));
  EXPECT_THAT(box.clamp({0.5, 0}), ElementsAre(0.5, 0));
  EXPECT_THAT(box.centre(), ElementsAre(0.5, 1));
}

// Asks for given poses in turn.
class Walker : public AskTell<> {
 public:
  explicit Walker(const Parameters&) {}
  void begin(Trial& trial) override { told_axes = trial.axes(); }
  Pose ask() override { return {-0.1 * ++asked, 0}; }
  void tell(const Observation& seen) override {
    told_steps.push_back(seen.step);
    told_merits.push_back(seen.merit);
  }
  std::optional<Pose> recommendation() override {
    if (told_merits.back() > 0.95) return std::nullopt;
    return Pose{-0.1 * asked, 0};
  }
  bool finished() const override { return told_merits.back() < finish_below; }

  static inline std::size_t told_axes;
  static inline std::vector<unsigned> told_steps;
  static inline std::vector<double> told_merits;
  static inline double finish_below;
  int asked = 0;
};

TEST(AskTell, TellsEveryObservationOnceAndStopsWithTheBudget) {
  Walker::told_steps.clear();
  Walker::told_merits.clear();
  Walker::finish_below = -1;
  SmallHost host;
  FakeTrial trial(line_setup());
  EXPECT_EQ(run<Walker>(host, trial), RELIGN_OK);
  EXPECT_EQ(Walker::told_axes, 2u);
  EXPECT_THAT(Walker::told_steps, ElementsAre(0, 1, 2, 3, 4));
  EXPECT_TRUE(trial.stopped);
  EXPECT_EQ(trial.requests_after_stop, 0u);
  ASSERT_EQ(trial.recommendations.size(), 4u);  // after every step but step 0
  EXPECT_EQ(trial.recommendations[0].steps_made, 1u);
  EXPECT_EQ(trial.recommendations[3].pose, trial.steps[3].pose);
}

TEST(AskTell, FinishesWhenItSaysSo) {
  Walker::told_steps.clear();
  Walker::told_merits.clear();
  Walker::finish_below = 0.85;
  SmallHost host;
  FakeTrial trial(line_setup());
  EXPECT_EQ(run<Walker>(host, trial), RELIGN_OK);
  EXPECT_FALSE(trial.stopped);
  EXPECT_EQ(trial.steps.size(), 2u);
  EXPECT_EQ(trial.recommendations.size(), 2u);
}

// One deed per class, so that each failure is seen alone.
struct Deeds : Optimizer {
  explicit Deeds(const Parameters&) {}
};
struct ThrowsInConstructor : Optimizer {
  explicit ThrowsInConstructor(const Parameters& given) { given.number("nonsense"); }
  void run(Trial&) override {}
};
struct ThrowsAnInt : Deeds {
  using Deeds::Deeds;
  void run(Trial&) override { throw 7; }
};
struct WrongAxes : Deeds {
  using Deeds::Deeds;
  void run(Trial& trial) override { trial.step({0.1}); }
};
struct NotFinite : Deeds {
  using Deeds::Deeds;
  void run(Trial& trial) override { trial.move({0.1, std::numeric_limits<double>::quiet_NaN()}); }
};
struct WantsImages : Deeds {
  using Deeds::Deeds;
  void run(Trial& trial) override { trial.first().image(); }
};
struct WantsBox : Deeds {
  using Deeds::Deeds;
  void run(Trial& trial) override { trial.box(); }
};

template <class Made>
std::string failure(std::uint32_t observes) {
  SmallHost host;
  FakeSetup setup = line_setup();
  setup.observes = observes;
  FakeTrial trial(setup);
  EXPECT_EQ(run<Made>(host, trial), RELIGN_FAILED);
  return host.failure;
}

TEST(Border, EveryExceptionBecomesAFailureWithItsText) {
  EXPECT_THAT(failure<ThrowsInConstructor>(0), HasSubstr("no parameter 'nonsense'"));
  EXPECT_THAT(failure<ThrowsAnInt>(0), HasSubstr("no std::exception"));
  EXPECT_THAT(failure<WrongAxes>(0), HasSubstr("wrong number of axes"));
  EXPECT_THAT(failure<NotFinite>(0), HasSubstr("not finite"));
  EXPECT_THAT(failure<WantsImages>(0), HasSubstr("declare \"images\""));
  EXPECT_THAT(failure<WantsBox>(0), HasSubstr("declare \"box\""));
}

struct SeesImages : Deeds {
  using Deeds::Deeds;
  void run(Trial& trial) override {
    const auto seen = trial.step({-0.25, 0});
    pixel = seen->image().at(7, 7);
    width = seen->image().width();
    merit = seen->merit;
  }
  static inline float pixel;
  static inline std::size_t width;
  static inline double merit;
};

TEST(Trial, GivesImagesAndMeritsAsGranted) {
  SmallHost host;
  FakeSetup setup = line_setup();
  setup.observes = RELIGN_OBSERVES_IMAGES;
  FakeTrial trial(setup);
  EXPECT_EQ(run<SeesImages>(host, trial), RELIGN_OK);
  EXPECT_EQ(SeesImages::pixel, 0.75f);
  EXPECT_EQ(SeesImages::width, 8u);
  EXPECT_TRUE(std::isnan(SeesImages::merit));
}

TEST(Border, OtherInterfacesAreNotOffered) {
  EXPECT_EQ(border::get_interface<Walker>(to_text(RELIGN_SCENE_INTERFACE)), nullptr);
  EXPECT_EQ(border::get_interface<Walker>(to_text("relign.algorithm/2")), nullptr);
  EXPECT_NE(border::get_interface<Walker>(to_text(RELIGN_ALGORITHM_INTERFACE)), nullptr);
}

}  // namespace
}  // namespace relign
