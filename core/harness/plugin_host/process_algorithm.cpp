#include "plugin_host/process_algorithm.h"

#include <cstring>

#include "plugin_host/process_numbers.h"

namespace relign::plugin_host {
namespace {

constexpr const char* kRun = "run";

struct NamedBit {
  std::uint32_t bit;
  const char* name;
};
constexpr NamedBit kKnowledge[] = {{RELIGN_KNOWS_IMAGES, "images"}, {RELIGN_KNOWS_MERIT, "merit"},
                                   {RELIGN_KNOWS_START, "start"},   {RELIGN_KNOWS_BOX, "box"},
                                   {RELIGN_KNOWS_DESIGN, "design"}, {RELIGN_KNOWS_LEVEL, "level"}};

// Written by hand: canonical text of doubles matters here, and a step should cost microseconds.
std::string run_line(const relign_task& task) {
  Json known = Json::array();
  for (const NamedBit& entry : kKnowledge)
    if (task.knows & entry.bit) known.push_back(entry.name);
  std::string line = R"({"message":"run","task":{"axes":)";
  line.append(task.axes_json.data, static_cast<std::size_t>(task.axes_json.size));
  line += ",\"budget\":" + std::to_string(task.budget) + ",\"seed\":" + std::to_string(task.seed) +
          ",\"knows\":" + known.dump() + ",\"largest_move\":";
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
  return line + "}}\n";
}

}  // namespace

ProcessAlgorithm::ProcessAlgorithm(const Choice& choice, const HostServices& services)
    : plugin_(choice, services), pixels_(plugin_.pixel_file()) {}

void ProcessAlgorithm::begin(const relign_conversation& talk) {
  const relign_task& task = *talk.task;
  axes_ = task.axes;
  image_bytes_ = std::size_t{task.image_width} * task.image_height * sizeof(float);
  if (!pixels_.grow(2 * image_bytes_)) plugin_.fail(kRun, kNoMemoryForPixels);
  services_.emplace(talk, pixels_, image_bytes_);
  plugin_.send_line(run_line(task), kRun);
}

void ProcessAlgorithm::run(const relign_conversation& talk) {
  begin(talk);
  Deadline stop_deadline;
  std::string late = "it was told to stop and did not return in time";
  for (std::size_t stops = 0;;) {
    const Json request = plugin_.receive(kRun, stop_deadline, late.c_str());
    if (request["message"] == "done") return;
    if (answer(request, talk) != RELIGN_STOP) continue;
    if (!stop_deadline) stop_deadline = in_seconds(plugin_.patience().stop_seconds);
    if (++stops > 1)
      late = "it was told " + std::to_string(stops) +
             " times that there are no more steps (step() gives None then) and did not return from run in time";
  }
}

relign_status ProcessAlgorithm::answer(const Json& request, const relign_conversation& talk) {
  const std::string& name = request["message"].get_ref<const std::string&>();
  relign_observation seen{};
  seen.struct_size = sizeof seen;
  relign_status status = RELIGN_UNSUPPORTED;
  bool observes = true;
  if (name == "step" || name == "move") {
    const bool relative = name == "move";
    const std::vector<double> values = plugin_.numbers(request, relative ? "delta" : "pose", kRun);
    status = (relative ? talk.move : talk.step)(talk.context, values.data(), static_cast<std::uint32_t>(values.size()),
                                                &seen);
  } else if (name == "recommend") {
    const std::vector<double> pose = plugin_.numbers(request, "pose", kRun);
    status = talk.recommend(talk.context, pose.data(), static_cast<std::uint32_t>(pose.size()));
    observes = false;
  } else if (name == "first") {
    status = talk.first(talk.context, &seen);
  } else if (name == "reference") {
    status = share_reference(talk);
    observes = false;
  } else if (name == "service") {
    const Json told = services_->answer(request);
    plugin_.send(told, kRun);
    return told["message"] == "stop" ? RELIGN_STOP : RELIGN_OK;
  }
  if (status == RELIGN_OK && observes)
    tell(seen);
  else if (status == RELIGN_OK)
    plugin_.send_line("{\"message\":\"ok\"}\n", kRun);
  else if (status == RELIGN_STOP)
    plugin_.send_line("{\"message\":\"stop\"}\n", kRun);
  else if (status == RELIGN_BAD_ARGUMENT)
    plugin_.send({{"message", "refused"},
                  {"text", name == "first" ? "step 0 can be seen until the first step is made"
                                           : "the host refused the pose (wrong number of axes, or not finite)"}},
                 kRun);
  else if (status == RELIGN_UNSUPPORTED)
    plugin_.send({{"message", "unsupported"}, {"text", "this host does not know the request \"" + name + "\""}}, kRun);
  else
    plugin_.send({{"message", "failed"}, {"text", name + ": the host reports a failure"}}, kRun);
  return status;
}

void ProcessAlgorithm::tell(const relign_observation& seen) {
  if (seen.image && image_bytes_ > 0) share(*seen.image, 0);
  line_ = "{\"message\":\"observation\",\"step\":" + std::to_string(seen.step) + ",\"pose\":";
  append_numbers(line_, seen.pose, axes_);
  line_ += ",\"merit\":";
  append_number(line_, seen.merit);
  line_ += ",\"limits_low\":" + std::to_string(seen.limits_low) +
           ",\"limits_high\":" + std::to_string(seen.limits_high) + ",\"machine_seconds\":";
  append_number(line_, seen.machine_seconds);
  line_ += "}\n";
  plugin_.send_line(line_, kRun);
}

// O* goes behind the image of the latest observation.
relign_status ProcessAlgorithm::share_reference(const relign_conversation& talk) {
  const relign_text id = {RELIGN_SERVICE_REFERENCE, std::strlen(RELIGN_SERVICE_REFERENCE)};
  const void* service = image_bytes_ > 0 && talk.get_service ? talk.get_service(talk.context, id) : nullptr;
  if (!service) return RELIGN_UNSUPPORTED;
  share(*static_cast<const relign_reference_service*>(service)->image, image_bytes_);
  return RELIGN_OK;
}

void ProcessAlgorithm::share(const relign_image& image, std::size_t offset_bytes) {
  if (!pixels_.put(image, offset_bytes, image_bytes_)) plugin_.fail(kRun, "an image is larger than the task said");
}

}  // namespace relign::plugin_host
