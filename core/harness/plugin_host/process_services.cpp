#include "plugin_host/process_services.h"

#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "base/pixel_region.h"
#include "plugin_host/guard.h"
#include "plugin_host/process_child.h"

namespace relign::plugin_host {
namespace {

constexpr const char* kNoMemoryForData = "the host has not enough memory for the shared data";
constexpr std::uint64_t kMaxDataBytes = std::uint64_t{1} << 30;  // as in relign/services/prepared.h

Json refused(const std::string& text) { return {{"message", "refused"}, {"text", text}}; }

Json unsupported(const std::string& what) {
  return {{"message", "unsupported"}, {"text", what + " is not offered to this algorithm"}};
}

std::string text_of(const Json& request, const char* member) {
  const auto found = request.find(member);
  return found != request.end() && found->is_string() ? found->get<std::string>() : "";
}

std::optional<std::uint64_t> whole_number(const Json& request, const char* member) {
  const auto found = request.find(member);
  if (found == request.end() || !found->is_number_unsigned()) return std::nullopt;
  return found->get<std::uint64_t>();
}

Json no_whole_number(const char* member) {
  return refused("expected a non-negative integer '" + std::string(member) + "'");
}

// A member as JSON text; "{}" when it is missing.
std::string object_text(const Json& request, const char* member) {
  const auto found = request.find(member);
  return found == request.end() ? "{}" : found->dump();
}

relign_text view(const std::string& text) { return {text.data(), text.size()}; }

// The answer for any status other than RELIGN_OK, with the service's message.
template <class Service>
Json failure_answer(relign_status status, const Service& service) {
  if (status == RELIGN_STOP) return {{"message", "stop"}};
  TextSink reason;
  service.why(service.context, reason.sink());
  const char* name = status == RELIGN_FAILED ? "failed" : status == RELIGN_UNSUPPORTED ? "unsupported" : "refused";
  return {{"message", name}, {"text", reason.text()}};
}

Json ask_measures(const Json& request, const relign_measures_service& measures) {
  const std::string call = text_of(request, "call");
  TextSink list;
  if (call == "list") {
    const relign_status status = measures.list(measures.context, list.sink());
    if (status != RELIGN_OK) return failure_answer(status, measures);
    return {{"message", "result"}, {"measures", parsed_json(list.text())}};
  }
  const std::string arguments = object_text(request, "arguments");
  if (call == "fields") {
    relign_field_measures fields{};
    fields.struct_size = sizeof fields;
    const relign_status status = measures.fields(measures.context, view(arguments), &fields);
    if (status != RELIGN_OK) return failure_answer(status, measures);
    Json all = Json::array();
    for (std::uint32_t i = 0; i < fields.count; ++i)
      all.push_back({{"name", std::string(fields.names[i].data, fields.names[i].size)},
                     {"mark_x_px", fields.mark_x_px[i]},
                     {"mark_y_px", fields.mark_y_px[i]},
                     {"tangential", fields.tangential[i]},
                     {"sagittal", fields.sagittal[i]}});
    return {{"message", "result"}, {"fields", all}};
  }
  if (call != "measure") return unsupported("'" + call + "'");
  const std::string name = text_of(request, "name");
  double value = 0;
  const relign_status status = measures.measure(measures.context, view(name), view(arguments), &value);
  if (status != RELIGN_OK) return failure_answer(status, measures);
  return {{"message", "result"}, {"value", value}};
}

// Asked for as {"regions": [[column, row, columns, rows], ...]}.
Json ask_regions(const Json& request, const relign_regions_service& service) {
  const std::string call = text_of(request, "call");
  if (call != "select") return unsupported("'" + call + "'");
  PixelRegions regions;
  try {
    regions = read_regions(request.value("regions", Json()));
  } catch (const Error& error) {
    return refused(error.what());
  }
  const std::vector<std::uint32_t> numbers = to_numbers(regions);
  const relign_status status =
      service.select(service.context, numbers.data(), static_cast<std::uint32_t>(regions.size()));
  return status == RELIGN_OK ? Json{{"message", "result"}} : failure_answer(status, service);
}

Json ask_prior(const Json& request, const relign_prior_service& prior) {
  const auto number = whole_number(request, "number");
  if (!number) return no_whole_number("number");
  TextSink drawn;
  const relign_status status = prior.draw(prior.context, *number, drawn.sink());
  if (status != RELIGN_OK) return failure_answer(status, prior);
  return {{"message", "result"}, {"drawn", parsed_json(drawn.text())}};
}

// Of the last `most` modules, newest first.
Json ask_history(const Json& request, const relign_history_service& history, std::uint32_t axes) {
  const auto most = whole_number(request, "most");
  if (!most) return no_whole_number("most");
  Json shifts = Json::array();
  std::vector<double> shift(axes);
  for (std::uint32_t back = 1; back <= history.modules && back <= *most; ++back) {
    const relign_status status = history.cure_shift(history.context, back, shift.data(), axes);
    if (status != RELIGN_OK) return failure_answer(status, history);
    shifts.push_back(shift);
  }
  return {{"message", "result"}, {"cure_shifts", std::move(shifts)}};
}

// The members of a message "observation"; null for null.
Json to_json(const relign_observation* observation, std::uint32_t axes) {
  if (!observation) return nullptr;
  return {{"step", observation->step},
          {"pose", std::vector<double>(observation->pose, observation->pose + axes)},
          {"merit", observation->merit},
          {"limits_low", observation->limits_low},
          {"limits_high", observation->limits_high},
          {"machine_seconds", observation->machine_seconds}};
}

}  // namespace

ProcessServices::ProcessServices(const relign_trial& trial, SharedPixels& pixels, std::size_t image_bytes)
    : trial_(trial), pixels_(pixels), image_bytes_(image_bytes) {}

Json ProcessServices::answer(const Json& request) {
  const std::string id = text_of(request, "service");
  const void* asked = service(id.c_str());
  if (asked && id == RELIGN_SERVICE_MEASURES)
    return ask_measures(request, *static_cast<const relign_measures_service*>(asked));
  if (asked && id == RELIGN_SERVICE_REGIONS)
    return ask_regions(request, *static_cast<const relign_regions_service*>(asked));
  if (asked && id == RELIGN_SERVICE_PRIOR) return ask_prior(request, *static_cast<const relign_prior_service*>(asked));
  if (asked && id == RELIGN_SERVICE_HISTORY)
    return ask_history(request, *static_cast<const relign_history_service*>(asked), trial_.task->axes);
  if (asked && id == RELIGN_SERVICE_RUN) return ask_run(request, *static_cast<const relign_run_service*>(asked));
  if (asked && id == RELIGN_SERVICE_MODEL) return ask_model(request, *static_cast<const relign_model_service*>(asked));
  if (asked && id == RELIGN_SERVICE_PREPARED)
    return ask_prepared(request, *static_cast<const relign_pretraining_service*>(asked));
  return unsupported("'" + id + "'");
}

const void* ProcessServices::service(const char* id) const {
  return trial_.get_service ? trial_.get_service(trial_.context, {id, std::strlen(id)}) : nullptr;
}

// ---- run --------------------------------------------------------------------------------------

Json ProcessServices::ask_run(const Json& request, const relign_run_service& run) {
  const std::string call = text_of(request, "call");
  if (call != "run") return unsupported("'" + call + "'");
  const auto steps = whole_number(request, "steps");
  if (!steps || *steps > std::numeric_limits<std::uint32_t>::max()) return no_whole_number("steps");
  const std::string parameter = text_of(request, "parameter");
  const std::string parameters = object_text(request, "parameters");
  relign_run_outcome outcome{};
  outcome.struct_size = sizeof outcome;
  const relign_status status =
      run.run(run.context, view(parameter), view(parameters), static_cast<std::uint32_t>(*steps), &outcome);
  const bool made_steps = status == RELIGN_OK || status == RELIGN_FAILED;
  Json reply = status == RELIGN_OK ? Json{{"message", "result"}} : failure_answer(status, run);
  if (!made_steps) return reply;
  // Also after a failure, because the other algorithm has moved the stage.
  const std::uint32_t axes = trial_.task->axes;
  reply["steps"] = outcome.steps;
  reply["last"] = to_json(outcome.last, axes);
  if (outcome.last && outcome.last->image && image_bytes_ > 0) pixels_.put(*outcome.last->image, 0, image_bytes_);
  if (status != RELIGN_OK) return reply;
  reply["end"] = outcome.end == RELIGN_RUN_FINISHED ? "finished" : "steps_spent";
  reply["best"] = to_json(outcome.best, axes);
  reply["recommendation"] = nullptr;
  if (outcome.recommendation)
    reply["recommendation"] = std::vector<double>(outcome.recommendation, outcome.recommendation + axes);
  return reply;
}

// ---- model ------------------------------------------------------------------------------------

Json ProcessServices::ask_model(const Json& request, const relign_model_service& model) {
  const std::string call = text_of(request, "call");
  if (call == "scene") {
    // Behind the trial's images, which must not change while the model works.
    const std::size_t offset = 2 * image_bytes_;
    if (!pixels_.grow(offset + std::size_t{model.image_width} * model.image_height * sizeof(float)))
      return {{"message", "failed"}, {"text", kNoMemoryForPixels}};
    const std::string scene(model.scene_json.data, static_cast<std::size_t>(model.scene_json.size));
    return {{"message", "result"},
            {"scene", parsed_json(scene)},
            {"image",
             {{"width", model.image_width},
              {"height", model.image_height},
              {"file", ChildProcess::pixel_path()},
              {"offset", offset}}}};
  }
  if (call == "mount") {
    const std::string offsets = object_text(request, "offsets");
    relign_model_lens* lens = nullptr;
    const relign_status status = model.mount(model.context, view(offsets), &lens);
    if (status != RELIGN_OK) return failure_answer(status, model);
    lenses_[++lenses_made_] = lens;
    return {{"message", "result"}, {"lens", lenses_made_}};
  }
  if (call == "capture" || call == "noise_free" || call == "unmount") return ask_lens(request, model, call);
  return unsupported("'" + call + "'");
}

Json ProcessServices::ask_lens(const Json& request, const relign_model_service& model, const std::string& call) {
  const auto number = whole_number(request, "lens");
  const auto known = number ? lenses_.find(*number) : lenses_.end();
  if (known == lenses_.end()) return refused("this lens is not mounted");
  if (call == "unmount") {
    const relign_status status = model.unmount(model.context, known->second);
    lenses_.erase(known);
    return status == RELIGN_OK ? Json{{"message", "result"}} : failure_answer(status, model);
  }
  std::vector<double> pose;
  if (const auto given = request.find("pose"); given != request.end() && given->is_array())
    for (const Json& value : *given)
      pose.push_back(value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN());
  const std::size_t offset = 2 * image_bytes_;
  if (pixels_.bytes() <= offset) return refused("request 'scene' first; its answer has the offset of the pixels");
  const auto axes = static_cast<std::uint32_t>(pose.size());
  relign_status status = RELIGN_OK;
  if (call == "noise_free") {
    status = model.noise_free(model.context, known->second, pose.data(), axes, pixels_.at(offset));
  } else {
    const auto seed = whole_number(request, "seed");
    if (!seed) return no_whole_number("seed");
    status = model.capture(model.context, known->second, pose.data(), axes, *seed, pixels_.at(offset));
  }
  return status == RELIGN_OK ? Json{{"message", "result"}} : failure_answer(status, model);
}

// ---- prepared ---------------------------------------------------------------------------------

// The data (any bytes) are in the shared file behind the model's pixels, so that neither overwrites the other.
Json ProcessServices::ask_prepared(const Json& request, const relign_pretraining_service& prepared) {
  const std::string call = text_of(request, "call");
  if (call == "source")
    return {{"message", "result"},
            {"active", prepared.active != 0},
            {"source", prepared.source},
            {"sources", prepared.sources}};
  if (call != "load" && call != "room" && call != "save") return unsupported("'" + call + "'");
  std::size_t offset = 2 * image_bytes_;
  if (const auto* model = static_cast<const relign_model_service*>(service(RELIGN_SERVICE_MODEL)))
    offset += std::size_t{model->image_width} * model->image_height * sizeof(float);
  const auto place = [&](const Json& bytes) -> Json {
    return {{"message", "result"}, {"bytes", bytes}, {"file", ChildProcess::pixel_path()}, {"offset", offset}};
  };
  if (call == "load") {
    TextSink data;
    const relign_status status = prepared.load(prepared.context, data.sink());
    if (status == RELIGN_UNSUPPORTED) return place(nullptr);  // no data
    if (status != RELIGN_OK) return failure_answer(status, prepared);
    if (!pixels_.grow(offset + data.text().size())) return {{"message", "failed"}, {"text", kNoMemoryForData}};
    if (!data.text().empty()) std::memcpy(pixels_.at(offset), data.text().data(), data.text().size());
    return place(data.text().size());
  }
  const auto bytes = whole_number(request, "bytes");
  if (!bytes) return no_whole_number("bytes");
  if (call == "room") {
    if (!prepared.active) return refused("cannot save in a benchmark trial, only in pretraining");
    if (*bytes > kMaxDataBytes) return refused("found " + std::to_string(*bytes) + " bytes; expected at most 1 GiB");
    if (!pixels_.grow(offset + *bytes)) return {{"message", "failed"}, {"text", kNoMemoryForData}};
    data_room_ = *bytes;
    return place(*bytes);
  }
  if (*bytes > data_room_) return refused("request 'room' first; its answer has the offset of the data");
  const char* data = *bytes > 0 ? reinterpret_cast<const char*>(pixels_.at(offset)) : "";
  const relign_status status = prepared.save(prepared.context, {data, *bytes});
  return status == RELIGN_OK ? Json{{"message", "result"}} : failure_answer(status, prepared);
}

}  // namespace relign::plugin_host
