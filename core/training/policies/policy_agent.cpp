#include "policy_agent.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "belief.hpp"
#include "picture.hpp"

namespace relign::policies {
namespace {

// The scene is another one if a block of the reference image differs by more than this share of a lit pixel.
constexpr double kSameScene = 0.002;
// And if a reference reading differs by more than this share of it.
constexpr double kSameReadings = 1e-4;

}  // namespace

double gain(unsigned step, std::int64_t whole_guesses) {
  return step <= whole_guesses ? 1.0 : 1.0 / (static_cast<double>(step) - static_cast<double>(whole_guesses) + 1);
}

PolicyAgent::PolicyAgent(const Parameters& given, double stop_below, std::int64_t full_moves)
    : PolicyAgent(given, given.text("model"), stop_below, full_moves) {}

PolicyAgent::PolicyAgent(const Parameters& given, const std::string& onnx_path, double stop_below,
                         std::int64_t full_moves)
    : model_(onnx_path),
      whole_guesses_(given.integer("whole_guesses")),
      other_scenes_(given.boolean("other_scenes")),
      stop_below_(stop_below),
      full_moves_(full_moves) {
  const SideFile& about = model_.about();
  if (stop_below_ > 0 && !about.doubt)
    throw std::invalid_argument("'stop_below' needs a network that predicts its own errors; '" + onnx_path +
                                "' does not ('doubt' in its side file)");
  if (full_moves_ > 0 && about.displacement)
    throw std::invalid_argument("'full_moves' needs a network that predicts the next move; '" + onnx_path +
                                "' predicts the displacement to the optimum, see 'whole_guesses'");
  const int rows = about.rows > 0 ? about.rows : about.size;
  frames_.assign(static_cast<std::size_t>(about.frames) * static_cast<std::size_t>(rows * about.size), 0.0F);
}

namespace {

// The training command names the scene of the network; the id of the trial's scene is not available to an algorithm.
std::string command_for_another(const SideFile& about) {
  std::string command = about.command;
  const std::string own = "--scene " + about.scene;
  if (const std::size_t at = command.find(own); at != std::string::npos)
    command.replace(at, own.size(), "--scene SCENE");
  return command;
}

// "'loss' in dB, 'hits'"
std::string listed(const std::vector<std::string>& names, const std::vector<std::string>& units) {
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k)
    text += (k > 0 ? ", '" : "'") + names[k] + "'" + (units[k].empty() ? "" : " in " + units[k]);
  return text.empty() ? "none" : text;
}

// The image of a capture, which is followed by a line of readings where the network observes them too.
ImageView picture_of(const ImageView& capture, const SideFile& about) {
  return about.history && !about.history->readings.empty() ? capture.without_last_row() : capture;
}

}  // namespace

void PolicyAgent::check_scene(const Trial& trial) const {
  const SideFile& about = model_.about();
  const std::string another = "; train a network for this scene: " + command_for_another(about);
  if (trial.axes() != about.axes.size())
    throw std::invalid_argument("the network was trained for " + std::to_string(about.axes.size()) +
                                " axes, this scene has " + std::to_string(trial.axes()) + another);
  if (about.history && !about.history->readings.empty()) check_readings(trial, another);
  if (about.frames == 0 || other_scenes_) return;
  const ImageView reference = picture_of(trial.reference(), about);
  const auto size = static_cast<std::size_t>(about.size);
  const std::size_t rows = about.rows > 0 ? static_cast<std::size_t>(about.rows) : size;
  const bool binnable = reference.width() % size == 0 && reference.height() % rows == 0 &&
                        reference.width() / size == reference.height() / rows && reference.width() >= size;
  if (!binnable)
    throw std::invalid_argument("images of " + std::to_string(reference.width()) + " x " +
                                std::to_string(reference.height()) + " pixels cannot be binned to the network's " +
                                std::to_string(size) + " x " + std::to_string(rows) + another);
  const std::vector<float> blocks = resampled(reference, about.blocks);
  bool same = true;
  for (std::size_t i = 0; same && i < blocks.size(); ++i)
    same =
        std::fabs(static_cast<double>(blocks[i]) - static_cast<double>(about.reference[i])) <= kSameScene * about.white;
  if (!same)
    throw std::invalid_argument("the network was trained for scene '" + about.scene +
                                "', this scene has another reference image" + another +
                                "; or run this one with the parameter \"other_scenes\": true");
}

void PolicyAgent::check_readings(const Trial& trial, const std::string& another) const {
  const SideFile& about = model_.about();
  std::vector<std::string> names, units;
  for (const nlohmann::json& reading : nlohmann::json::parse(trial.readings_json())) {
    names.push_back(reading.at("name").get<std::string>());
    units.push_back(reading.value("unit", std::string()));
  }
  const std::string found = listed(names, units), known = listed(about.history->readings, about.history->units);
  if (found != known)
    throw std::invalid_argument("the network was trained for the readings " + known + ", this scene has " + found +
                                another);
  if (other_scenes_ || about.frames > 0) return;
  const ImageView reference = trial.reference();
  for (std::size_t k = 0; k < about.reference.size(); ++k) {
    const auto own = static_cast<double>(about.reference[k]);
    const auto here = static_cast<double>(reference.row(reference.height() - 1)[k]);
    if (std::fabs(own - here) > kSameReadings * std::fabs(own))
      throw std::invalid_argument("the network was trained for scene '" + about.scene + "', whose reference reading '" +
                                  about.history->readings[k] + "' is " + std::to_string(own) + "; here it is " +
                                  std::to_string(here) + another +
                                  "; or run this one with the parameter \"other_scenes\": true");
  }
}

void PolicyAgent::push_frame(const ImageView& image) {
  const SideFile& about = model_.about();
  std::vector<float> picture = resampled(image, about.size, about.rows);
  if (!about.irradiance) to_bytes(picture, about.white, about.byte_whites);
  const auto one = static_cast<std::ptrdiff_t>(picture.size());
  std::copy(frames_.begin() + one, frames_.end(), frames_.begin());
  std::copy(picture.begin(), picture.end(), frames_.end() - one);
}

namespace {

void clamp(Pose& move, double largest) {
  for (double& along : move) along = std::clamp(along, -largest, largest);
}

}  // namespace

void PolicyAgent::follow_displacements(Trial& trial) {
  std::optional<Observation> observation = trial.first();
  for (unsigned step = 1; observation; ++step) {
    push_frame(observation->image());
    Pose move = model_.answer(frames_);
    for (double& along : move) along *= gain(step, whole_guesses_);
    Pose target = observation->pose;
    for (std::size_t axis = 0; axis < move.size(); ++axis) target[axis] += move[axis];
    trial.recommend(target);
    clamp(move, trial.largest_move());
    observation = trial.move(move);
  }
}

void PolicyAgent::follow_belief(Trial& trial, const Doubt& doubt) {
  Belief belief(doubt);
  std::optional<Observation> observation = trial.first();
  while (observation) {
    push_frame(observation->image());
    belief.add(observation->pose, model_.answer(frames_));
    const Belief::Optimum expected = belief.optimum(observation->pose);
    trial.recommend(expected.pose);
    if (expected.rmse - expected.rmse_after < stop_below_) return;
    Pose move = expected.pose;
    for (std::size_t axis = 0; axis < move.size(); ++axis) move[axis] -= observation->pose[axis];
    clamp(move, trial.largest_move());
    observation = trial.move(move);
  }
}

void PolicyAgent::follow_moves(Trial& trial) {
  const ImageView reference = trial.reference();
  double lowest = std::numeric_limits<double>::infinity();
  std::optional<Observation> observation = trial.first();
  for (std::int64_t step = 1; observation; ++step) {
    if (const double measured = rmse(observation->image(), reference); measured < lowest) {
      lowest = measured;
      trial.recommend(observation->pose);
    }
    push_frame(observation->image());
    Pose move = model_.answer(frames_);
    clamp(move, trial.largest_move());
    if (full_moves_ > 0 && step > full_moves_)
      for (double& along : move) along *= static_cast<double>(full_moves_) / static_cast<double>(step);
    observation = trial.move(move);
  }
}

void PolicyAgent::follow_history(Trial& trial) {
  const SideFile& about = model_.about();
  const bool measured = about.history->score >= 0;
  const bool recommends_lowest = measured && about.frames == 0;
  const std::size_t count = about.history->readings.size();
  const double largest =
      about.largest_move > 0 ? std::min(about.largest_move, trial.largest_move()) : trial.largest_move();
  History history(*about.history);
  std::optional<Observation> observation = trial.first();
  const Pose start = observation->pose;
  float lowest = std::numeric_limits<float>::infinity();
  for (std::size_t step = 0; observation; ++step) {
    const ImageView image = observation->image();
    const float* line = image.row(image.height() - 1);
    const std::vector<float> readings(line, line + count);
    if (about.frames > 0) push_frame(picture_of(image, about));
    history.add(observation->pose, readings);
    if (measured) lowest = std::min(lowest, readings[static_cast<std::size_t>(about.history->score)]);
    if (recommends_lowest) trial.recommend(history.best());
    const Pose& here = observation->pose;
    Pose move(here.size());
    if (step < about.probes.poses.size() && static_cast<double>(lowest) >= about.probes.until) {
      for (std::size_t axis = 0; axis < move.size(); ++axis)
        move[axis] = start[axis] + about.probes.poses[step][axis] - here[axis];
      clamp(move, trial.largest_move());
    } else {
      std::vector<float> input = frames_;
      const std::vector<float> remembered = history.input();
      input.insert(input.end(), remembered.begin(), remembered.end());
      move = model_.answer(input);
      clamp(move, largest);
    }
    Pose target = here;
    for (std::size_t axis = 0; axis < move.size(); ++axis) target[axis] += move[axis];
    if (!recommends_lowest && about.displacement) trial.recommend(target);
    // Not trial.move, which starts where the stage has stopped: at a limit that is not the pose that was observed.
    observation = trial.step(target);
  }
}

void PolicyAgent::run(Trial& trial) {
  check_scene(trial);
  if (model_.about().history)
    follow_history(trial);
  else if (model_.about().doubt)
    follow_belief(trial, *model_.about().doubt);
  else if (model_.about().displacement)
    follow_displacements(trial);
  else
    follow_moves(trial);
}

}  // namespace relign::policies
