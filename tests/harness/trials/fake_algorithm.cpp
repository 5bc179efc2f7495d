// An algorithm that follows a script and logs every answer. Actions:
//   step POSE, move DELTA, recommend POSE, first   the functions of the trial
//   insist N, insist_badly N    N requests whose answers are ignored; the second without axes
//   fail                        fails with a message
//   nap MS                      sleeps
//   round_up, rounding          sets the rounding mode; logs the current one
//   leave_folder                changes the working directory
// Values may be "nan" or "inf". The script "refuse_to_be_made" fails in the constructor.
#include <unistd.h>

#include <cfenv>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <relign/plugin.hpp>
#include <thread>

namespace {

using Json = nlohmann::json;

std::vector<double> numbers(const Json& action) {
  std::vector<double> values;
  for (std::size_t i = 1; i < action.size(); ++i)
    values.push_back(action[i].is_string() ? std::stod(action[i].get<std::string>()) : action[i].get<double>());
  return values;
}

class FakeAlgorithm final : public relign::FAKE_BASE {
 public:
  explicit FakeAlgorithm(const relign::Parameters& given)
      : host_(given), script_(Json::parse(given.json()).at("script")) {
    if (script_ == "refuse_to_be_made") throw std::runtime_error("no model file");
  }

  void run(relign::Trial& trial) override {
    Json task = {{"axes", trial.axes()}, {"budget", trial.budget()}, {"seed", trial.seed()}};
    task["observes"] = 0;
    for (int bit = 0; bit < 6; ++bit)
      if (trial.observes(1u << bit)) task["observes"] = task["observes"].get<int>() | 1 << bit;
    task["largest_move"] = std::isinf(trial.largest_move()) ? Json("unlimited") : Json(trial.largest_move());
    try {
      task["box"] = {trial.box().lower, trial.box().upper};
    } catch (const std::logic_error&) {
      task["box"] = nullptr;
    }
    task["service"] = trial.service("reference") != nullptr;
    log("task", task);
    for (const Json& action : script_) act(trial, action);
  }

 private:
  void act(relign::Trial& trial, const Json& action) {
    const std::string verb = action.at(0);
    try {
      if (verb == "first") {
        show(trial.first());
      } else if (verb == "step" || verb == "move") {
        const auto seen = verb == "step" ? trial.step(numbers(action)) : trial.move(numbers(action));
        if (seen)
          show(*seen);
        else
          log("answer", "stop");
      } else if (verb == "recommend") {
        trial.recommend(numbers(action));
      }
    } catch (const std::invalid_argument&) {
      log("answer", "bad argument");
      return;
    }
    if (verb == "insist") {
      for (std::int64_t i = action.at(1); i > 0; --i) trial.step(relign::Pose(trial.axes(), 0.5));
    } else if (verb == "insist_badly") {
      for (std::int64_t i = action.at(1); i > 0; --i) {
        try {
          trial.step({});
        } catch (const std::invalid_argument&) {
        }
      }
    } else if (verb == "fail") {
      throw std::runtime_error("out of ideas");
    } else if (verb == "round_up") {
      std::fesetround(FE_UPWARD);
    } else if (verb == "leave_folder") {
      if (::chdir("/") != 0) throw std::runtime_error("chdir");
    } else if (verb == "nap") {
      std::this_thread::sleep_for(std::chrono::milliseconds(action.at(1).get<int>()));
    } else if (verb == "show_buffers") {  // addresses of pixels differ between processes
      shows_buffers_ = true;
    } else if (verb == "rounding") {
      log("rounding", std::fegetround() == FE_UPWARD ? "up" : "nearest");
    }
  }

  void show(const relign::Observation& seen) {
    Json shown = {{"step", seen.step},
                  {"pose", seen.pose},
                  {"low", seen.limits_low},
                  {"high", seen.limits_high},
                  {"seconds", seen.machine_seconds}};
    shown["merit"] = std::isnan(seen.merit) ? Json(nullptr) : Json(seen.merit);
    shown["pixel"] = seen.image_ ? Json(seen.image().at(2, 1)) : Json(nullptr);
    log("seen", shown);
    if (shows_buffers_)
      log("buffer", seen.image_ ? Json(reinterpret_cast<std::uintptr_t>(seen.image().row(0))) : Json(nullptr));
  }
  void log(const char* what, const Json& value) { host_.warn(std::string(what) + " " + value.dump()); }

  relign::Parameters host_;
  Json script_;
  bool shows_buffers_ = false;
};

}  // namespace

RELIGN_PLUGIN(FakeAlgorithm)
