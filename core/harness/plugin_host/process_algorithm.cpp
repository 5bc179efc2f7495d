#include "plugin_host/process_algorithm.h"

#include <cstring>

#include "plugin_host/process_child.h"

namespace relign::plugin_host {
namespace {

constexpr const char* kRun = "run";

struct NamedBit {
  std::uint32_t bit;
  const char* name;
};
constexpr NamedBit kObservationNames[] = {{RELIGN_OBSERVES_IMAGES, "images"},  {RELIGN_OBSERVES_MERIT, "merit"},
                                          {RELIGN_OBSERVES_START, "start"},    {RELIGN_OBSERVES_BOX, "box"},
                                          {RELIGN_OBSERVES_DESIGN, "design"},  {RELIGN_OBSERVES_LEVEL, "level"},
                                          {RELIGN_OBSERVES_HISTORY, "history"}};

// Not by a JSON library: doubles need their canonical text here, and a step should cost microseconds.
std::string run_line(const relign_task& task) {
  Json known = Json::array();
  for (const NamedBit& entry : kObservationNames)
    if (task.observes & entry.bit) known.push_back(entry.name);
  std::string line = R"({"message":"run","task":{"axes":)";
  line.append(task.axes_json.data, static_cast<std::size_t>(task.axes_json.size));
  line += ",\"budget\":" + std::to_string(task.budget) + ",\"seed\":" + std::to_string(task.seed) +
          ",\"observes\":" + known.dump() + ",\"largest_move\":";
  append_number(line, task.largest_move);
  if (task.box_lower && task.box_upper) {
    line += ",\"box\":{\"lower\":";
    append_numbers(line, task.box_lower, task.axes);
    line += ",\"upper\":";
    append_numbers(line, task.box_upper, task.axes);
    line += '}';
  }
  if (task.image_width > 0 && task.image_height > 0)
    line += ",\"image\":{\"width\":" + std::to_string(task.image_width) +
            ",\"height\":" + std::to_string(task.image_height) + ",\"file\":\"" + ChildProcess::pixel_path() + "\"}";
  if (const std::string_view readings(task.readings_json.data, task.readings_json.size); readings.size() > 2)
    (line += ",\"readings\":") += readings;
  return line + "}}\n";
}

}  // namespace

ProcessAlgorithm::ProcessAlgorithm(const Choice& choice, const HostServices& services)
    : plugin_(choice, services), pixels_(plugin_.pixel_file(), plugin_.take_pixels()) {}

void ProcessAlgorithm::begin(const relign_trial& trial) {
  const relign_task& task = *trial.task;
  axes_ = task.axes;
  image_bytes_ = std::size_t{task.image_width} * task.image_height * sizeof(float);
  if (!pixels_.grow(2 * image_bytes_)) plugin_.fail(kRun, kNoMemoryForPixels);
  services_.emplace(trial, pixels_, image_bytes_);
  plugin_.send_line(run_line(task), kRun);
}

void ProcessAlgorithm::run(const relign_trial& trial) {
  begin(trial);
  Deadline stop_deadline;
  std::string late = "it did not return in time after a stop";
  for (std::size_t stops = 0;;) {
    const Json request = plugin_.receive(kRun, stop_deadline, late.c_str());
    if (request["message"] == "done") return;
    if (answer(request, trial) != RELIGN_STOP) continue;
    if (!stop_deadline) stop_deadline = in_seconds(plugin_.timeouts().stop_seconds);
    if (++stops > 1)
      late = "it did not return from run in time after " + std::to_string(stops) +
             " stops (step() returns None when there are no more steps)";
  }
}

relign_status ProcessAlgorithm::answer(const Json& request, const relign_trial& trial) {
  const std::string& name = request["message"].get_ref<const std::string&>();
  relign_observation observation{};
  observation.struct_size = sizeof observation;
  relign_status status = RELIGN_UNSUPPORTED;
  bool observes = true;
  if (name == "step" || name == "move") {
    const bool relative = name == "move";
    const std::vector<double> values = plugin_.numbers(request, relative ? "delta" : "pose", kRun);
    status = (relative ? trial.move : trial.step)(trial.context, values.data(),
                                                  static_cast<std::uint32_t>(values.size()), &observation);
  } else if (name == "recommend") {
    const std::vector<double> pose = plugin_.numbers(request, "pose", kRun);
    status = trial.recommend(trial.context, pose.data(), static_cast<std::uint32_t>(pose.size()));
    observes = false;
  } else if (name == "first") {
    status = trial.first(trial.context, &observation);
  } else if (name == "reference") {
    status = share_reference(trial);
    observes = false;
  } else if (name == "service") {
    const Json reply = services_->answer(request);
    plugin_.send(reply, kRun);
    return reply["message"] == "stop" ? RELIGN_STOP : RELIGN_OK;
  }
  if (status == RELIGN_OK && observes)
    send_observation(observation);
  else if (status == RELIGN_OK)
    plugin_.send_line("{\"message\":\"ok\"}\n", kRun);
  else if (status == RELIGN_STOP)
    plugin_.send_line("{\"message\":\"stop\"}\n", kRun);
  else if (status == RELIGN_BAD_ARGUMENT)
    plugin_.send({{"message", "refused"},
                  {"text", name == "first" ? "step 0 is available only before the first step"
                                           : "invalid pose (wrong number of axes, or not finite)"}},
                 kRun);
  else if (status == RELIGN_UNSUPPORTED)
    plugin_.send({{"message", "unsupported"}, {"text", "unknown request '" + name + "'"}}, kRun);
  else
    plugin_.send({{"message", "failed"}, {"text", name + ": the host reported a failure"}}, kRun);
  return status;
}

void ProcessAlgorithm::send_observation(const relign_observation& observation) {
  if (observation.image && image_bytes_ > 0) share(*observation.image, 0);
  line_ = "{\"message\":\"observation\",\"step\":" + std::to_string(observation.step) + ",\"pose\":";
  append_numbers(line_, observation.pose, axes_);
  line_ += ",\"merit\":";
  append_number(line_, observation.merit);
  line_ += ",\"limits_low\":" + std::to_string(observation.limits_low) +
           ",\"limits_high\":" + std::to_string(observation.limits_high) + ",\"machine_seconds\":";
  append_number(line_, observation.machine_seconds);
  line_ += "}\n";
  plugin_.send_line(line_, kRun);
}

// Places O* behind the image of the latest observation.
relign_status ProcessAlgorithm::share_reference(const relign_trial& trial) {
  const relign_text id = {RELIGN_SERVICE_REFERENCE, std::strlen(RELIGN_SERVICE_REFERENCE)};
  const void* service = image_bytes_ > 0 && trial.get_service ? trial.get_service(trial.context, id) : nullptr;
  if (!service) return RELIGN_UNSUPPORTED;
  share(*static_cast<const relign_reference_service*>(service)->image, image_bytes_);
  return RELIGN_OK;
}

void ProcessAlgorithm::share(const relign_image& image, std::size_t offset_bytes) {
  if (!pixels_.put(image, offset_bytes, image_bytes_)) plugin_.fail(kRun, "an image is larger than stated in the task");
}

}  // namespace relign::plugin_host
