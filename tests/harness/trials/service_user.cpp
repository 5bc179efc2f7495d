// An algorithm that calls services according to a script and logs the answers. Actions:
//   reference                          logs the sum and size of O*
//   measure NAME [ARGUMENTS]           logs the value (null for NaN)
//   fields ARGUMENTS                   logs the fields of the last capture
//   select REGIONS                     logs whether the scene captures regions
//   list                               logs the names of the measures
//   draw NUMBER                        logs the draw, a text
//   history [BACK]                     logs the measured shifts of all earlier modules, or of one
//   run PARAMETER STEPS [PARAMETERS]   logs the outcome
//   model OFFSETS POSE SEED            logs the first pixel of a capture, and of a noise-free one
//   lens POSE SEED NAME ARGUMENTS      logs a measure of a capture in the model, and the lens's fields
//   slopes POSE SEED SAMPLES ELEMENTS   logs the first and the last pixel of each image
//   model_nap MS                       captures in the model for that long
//   keep_lens                          keeps a mounted lens beyond run
//   load, save TEXT                    logs whether it is in pretraining, and what it loads
//   step POSE, recommend POSE, round_up, rounding
// Exceptions are logged under "refused", and the script continues.
#include <array>
#include <cfenv>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>

namespace {

using Json = nlohmann::json;

Json number(double value) { return std::isnan(value) ? Json(nullptr) : Json(value); }

Json shown(const std::optional<relign::Observation>& seen) {
  if (!seen) return nullptr;
  return {
      {"step", seen->step}, {"pose", seen->pose}, {"merit", number(seen->merit)}, {"image", seen->image_ != nullptr}};
}

class ServiceUser final : public relign::Optimizer {
 public:
  explicit ServiceUser(const relign::Parameters& given)
      : host_(given), script_(Json::parse(given.json()).at("script")) {}

  void run(relign::Trial& trial) override {
    for (const Json& action : script_) {
      try {
        act(trial, action);
      } catch (const std::exception& error) {
        log("refused", error.what());
      }
    }
  }

 private:
  void act(relign::Trial& trial, const Json& action) {
    const std::string verb = action.at(0);
    if (verb == "reference") {
      const relign::ImageView image = trial.reference();
      double sum = 0;
      for (std::size_t y = 0; y < image.height(); ++y)
        for (std::size_t x = 0; x < image.width(); ++x) sum += static_cast<double>(image.at(x, y));
      log(verb, {image.width(), image.height(), sum});
    } else if (verb == "measure") {
      const std::string name = action.at(1);
      log(verb, number(trial.measures().measure(name, action.size() > 2 ? action.at(2).dump() : "")));
    } else if (verb == "fields") {
      Json fields = Json::array();
      for (const relign::FieldMeasure& field : trial.measures().fields(action.at(1).dump()))
        fields.push_back({{"name", field.name},
                          {"mark_x_px", number(field.mark_x_px)},
                          {"mark_y_px", number(field.mark_y_px)},
                          {"tangential", number(field.tangential)},
                          {"sagittal", number(field.sagittal)}});
      log(verb, fields);
    } else if (verb == "select") {
      std::vector<relign::Region> regions;
      for (const auto& region : action.at(1).get<std::vector<std::array<std::uint32_t, 4>>>())
        regions.push_back({region[0], region[1], region[2], region[3]});
      log(verb, trial.regions().select(regions));
    } else if (verb == "list") {
      log(verb, Json::parse(trial.measures().list()));
    } else if (verb == "draw") {
      log(verb, trial.prior().draw(action.at(1)));  // as text: numbers would be read in the plugin's rounding mode
    } else if (verb == "history") {
      const relign::History history = trial.history();
      if (action.size() > 1) return log(verb, history.cure_shift(action.at(1).get<std::uint32_t>()));
      Json shifts = Json::array();
      for (std::uint32_t back = 1; back <= history.modules(); ++back) shifts.push_back(history.cure_shift(back));
      log(verb, shifts);
    } else if (verb == "run") {
      const relign::RunOutcome outcome = trial.run(action.at(1).get<std::string>(), action.at(2).get<unsigned>(),
                                                   action.size() > 3 ? action.at(3).dump() : "");
      Json told = {{"steps", outcome.steps}, {"finished", outcome.finished}};
      told["last"] = shown(outcome.last);
      told["best"] = shown(outcome.best);
      told["recommendation"] = outcome.recommendation ? Json(*outcome.recommendation) : Json(nullptr);
      log(verb, told);
    } else if (verb == "model") {
      const relign::ModelLens lens = trial.model().mount(action.at(1).dump());
      const relign::Pose pose = action.at(2);
      const auto noisy = lens.capture(pose, action.at(3).get<std::uint64_t>());
      const auto clean = lens.noise_free(pose);
      log(verb, {noisy.size(), noisy.front(), clean ? Json(clean->front()) : Json(nullptr)});
    } else if (verb == "lens") {
      const relign::ModelLens lens = trial.model().mount("{}");
      const relign::Pose pose = action.at(1);
      if (action.at(2) >= 0) lens.capture(pose, action.at(2).get<std::uint64_t>());
      const double value = lens.measure(action.at(3).get<std::string>());
      const auto fields = lens.fields(pose, action.at(4).dump());
      Json seen = Json::array();
      if (fields)
        for (const relign::ModelField& field : *fields)
          seen.push_back({field.x_px, field.y_px, field.tangential, field.sagittal});
      log(verb, {value, fields ? seen : Json(nullptr)});
    } else if (verb == "slopes") {
      const relign::ModelLens lens = trial.model().mount("{}");
      const auto images =
          lens.slopes(action.at(1), action.at(2).get<std::uint64_t>(), action.at(3).get<std::uint32_t>(),
                      action.at(4).get<std::vector<std::uint32_t>>());
      Json seen = Json::array();
      for (std::size_t i = 0; images && i < images->size(); i += 6) seen.push_back({images->at(i), images->at(i + 5)});
      log(verb, seen);
    } else if (verb == "model_nap") {
      const relign::ModelLens lens = trial.model().mount("{}");
      const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(action.at(1).get<int>());
      while (std::chrono::steady_clock::now() < end) lens.capture(relign::Pose(trial.axes(), 0.5), 1);
    } else if (verb == "keep_lens") {
      kept_.emplace(trial.model().mount("{}"));
    } else if (verb == "step") {
      log(verb, shown(trial.step(action.at(1).get<relign::Pose>())));
    } else if (verb == "recommend") {
      trial.recommend(action.at(1).get<relign::Pose>());
    } else if (verb == "load") {
      const auto loaded = trial.pretraining().load();
      log(verb, {trial.pretraining().active(), loaded ? Json(*loaded) : Json(nullptr)});
    } else if (verb == "save") {
      trial.pretraining().save(action.at(1).get<std::string>());
    } else if (verb == "round_up") {
      std::fesetround(FE_UPWARD);
    } else if (verb == "rounding") {
      log(verb, std::fegetround() == FE_UPWARD ? "up" : "nearest");
    }
  }
  void log(const std::string& what, const Json& value) { host_.warn(what + " " + value.dump()); }

  relign::Parameters host_;
  Json script_;
  std::optional<relign::ModelLens> kept_;
};

}  // namespace

RELIGN_PLUGIN(ServiceUser)
