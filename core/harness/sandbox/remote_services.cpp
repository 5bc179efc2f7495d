#include "sandbox/remote_services.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/json_members.h"
#include "base/pixel_region.h"
#include "plugin_host/process_numbers.h"

namespace relign::sandbox {
namespace {

std::string text_of(relign_text text) {
  return text.data ? std::string(text.data, static_cast<std::size_t>(text.size)) : std::string();
}

// JSON that a plugin wrote; the host refuses what is none.
Json object_of(relign_text text) {
  const std::string given = text_of(text);
  if (given.empty()) return Json::object();
  Json object = parsed_json(given);
  return object.is_discarded() ? Json(given) : object;
}

void write(const relign_text_sink* sink, const std::string& text) {
  sink->write(sink->context, {text.data(), text.size()});
}

std::vector<double> values_of(const double* values, std::uint32_t count) {
  return values ? std::vector<double>(values, values + count) : std::vector<double>();
}

// Lenses are numbers in messages and pointers in the table; the host counts from 1.
std::uint64_t number_of(const relign_model_lens* lens) { return reinterpret_cast<std::uintptr_t>(lens); }

double number_or_nan(const Json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

relign_status status_of(const Json& answer) {
  const std::string& name = answer.at("message").get_ref<const std::string&>();
  if (name == "observation" || name == "ok" || name == "result") return RELIGN_OK;
  if (name == "stop") return RELIGN_STOP;
  if (name == "refused") return RELIGN_BAD_ARGUMENT;
  return name == "unsupported" ? RELIGN_UNSUPPORTED : RELIGN_FAILED;
}

std::vector<double> numbers(const Json& list) {
  std::vector<double> values;
  for (const Json& value : list) values.push_back(number_or_nan(value));
  return values;
}

void add_exact(std::string& line, const double* values, std::size_t count) {
  line += '[';
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) line += ',';
    if (values[i] == 0 && std::signbit(values[i]))
      line += "-0.0";  // "-0" would be read as an integer
    else
      plugin_host::append_number(line, values[i]);
  }
  line += ']';
}

void RemoteObservation::take(const Json& message, const relign_image* image) {
  pose_ = numbers(message.at("pose"));
  observation_.struct_size = sizeof observation_;
  observation_.step = message.at("step").get<std::uint32_t>();
  observation_.pose = pose_.data();
  observation_.merit = number_or_nan(message.at("merit"));
  observation_.limits_low = message.at("limits_low").get<std::uint64_t>();
  observation_.limits_high = message.at("limits_high").get<std::uint64_t>();
  observation_.image = image;
  observation_.machine_seconds = number_or_nan(message.at("machine_seconds"));
}

void RemoteObservation::write(relign_observation* seen) const {
  relign_observation all = observation_;
  all.struct_size = static_cast<std::uint32_t>(std::min<std::size_t>(seen->struct_size, sizeof all));
  std::memcpy(seen, &all, all.struct_size);
}

RemoteServices::RemoteServices(Connection& connection, const Json& task) : connection_(connection) {
  if (const auto image = task.find("image"); image != task.end()) {
    width_ = image->at("width").get<std::uint32_t>();
    height_ = image->at("height").get<std::uint32_t>();
  }
  fill_tables();
}

relign_image RemoteServices::image_at(std::size_t offset) {
  relign_image image{};
  image.struct_size = sizeof image;
  image.sample_format = RELIGN_SAMPLE_FLOAT32;
  image.width = width_;
  image.height = height_;
  image.channels = 1;
  image.row_stride_bytes = std::uint64_t{width_} * sizeof(float);
  image.pixels =
      reinterpret_cast<const float*>(connection_.shared(offset, std::uint64_t{width_} * height_, sizeof(float)));
  return image;
}

const relign_image* RemoteServices::latest_image() {
  if (width_ == 0 || height_ == 0) return nullptr;
  latest_ = image_at(0);
  return &latest_;
}

Json RemoteServices::ask(const char* service, const char* call, Json arguments) {
  arguments["message"] = "service";
  arguments["service"] = service;
  arguments["call"] = call;
  connection_.send(arguments);
  Json answer = connection_.receive();
  why_ = relign::text_of(answer, "text");
  return answer;
}

bool RemoteServices::offers(const char* service, const char* call) {
  return ask(service, call).at("message") != "unsupported";
}

const void* RemoteServices::get(std::string_view id) {
  if (id == RELIGN_SERVICE_REFERENCE) return reference();
  if (id == RELIGN_SERVICE_MEASURES) return offers(RELIGN_SERVICE_MEASURES, "list") ? &measures_ : nullptr;
  // Without its arguments a call is refused where the service is offered, and does nothing.
  if (id == RELIGN_SERVICE_REGIONS) return offers(RELIGN_SERVICE_REGIONS, "select") ? &regions_ : nullptr;
  if (id == RELIGN_SERVICE_PRIOR) return offers(RELIGN_SERVICE_PRIOR, "draw") ? &prior_ : nullptr;
  if (id == RELIGN_SERVICE_RUN) return offers(RELIGN_SERVICE_RUN, "run") ? &run_ : nullptr;
  if (id == RELIGN_SERVICE_MODEL) {
    const Json answer = ask(RELIGN_SERVICE_MODEL, "scene");
    if (status_of(answer) != RELIGN_OK) return nullptr;
    scene_json_ = answer.at("scene").dump();
    model_.scene_json = {scene_json_.data(), scene_json_.size()};
    model_.image_width = answer.at("image").at("width").get<std::uint32_t>();
    model_.image_height = answer.at("image").at("height").get<std::uint32_t>();
    model_offset_ = answer.at("image").at("offset").get<std::size_t>();
    return &model_;
  }
  if (id == RELIGN_SERVICE_HISTORY) return history();
  if (id != RELIGN_SERVICE_PREPARED) return nullptr;
  const Json answer = ask(RELIGN_SERVICE_PREPARED, "source");
  if (status_of(answer) != RELIGN_OK) return nullptr;
  prepared_.active = answer.at("active").get<bool>() ? 1 : 0;
  prepared_.source = answer.at("source").get<std::uint32_t>();
  prepared_.sources = answer.at("sources").get<std::uint32_t>();
  return &prepared_;
}

// All at once: a batch has few modules.
const void* RemoteServices::history() {
  const Json answer = ask(RELIGN_SERVICE_HISTORY, "cure_shifts", {{"most", std::numeric_limits<std::uint32_t>::max()}});
  if (status_of(answer) != RELIGN_OK) return nullptr;
  cure_shifts_.clear();
  for (const Json& shift : answer.at("cure_shifts")) cure_shifts_.push_back(numbers(shift));
  history_.modules = static_cast<std::uint32_t>(cure_shifts_.size());
  return &history_;
}

const void* RemoteServices::reference() {
  if (!reference_table_.image) {
    connection_.send_line("{\"message\":\"reference\"}\n");
    if (status_of(connection_.receive()) != RELIGN_OK) return nullptr;
    reference_table_.struct_size = sizeof reference_table_;
    reference_table_.image = &reference_;
  }
  reference_ = image_at(std::size_t{width_} * height_ * sizeof(float));
  return &reference_table_;
}

relign_status RemoteServices::run(relign_text parameter, relign_text changes, std::uint32_t steps,
                                  relign_run_outcome* outcome) {
  const Json answer = ask(RELIGN_SERVICE_RUN, "run",
                          {{"parameter", text_of(parameter)}, {"parameters", object_of(changes)}, {"steps", steps}});
  relign_run_outcome all{};
  all.struct_size = static_cast<std::uint32_t>(std::min<std::size_t>(outcome->struct_size, sizeof all));
  const auto observed = [&](const char* name, RemoteObservation& observation,
                            bool with_image) -> const relign_observation* {
    const auto found = answer.find(name);
    if (found == answer.end() || found->is_null()) return nullptr;
    observation.take(*found, with_image ? latest_image() : nullptr);
    return observation.get();
  };
  if (answer.contains("steps")) {
    all.steps = answer.at("steps").get<std::uint32_t>();
    all.last = observed("last", run_last_, true);
    const bool best_is_last = answer.contains("best") && answer.at("best") == answer.at("last");
    all.best = observed("best", run_best_, best_is_last);
    all.end = answer.value("end", "") == "finished" ? RELIGN_RUN_FINISHED : RELIGN_RUN_STEPS_SPENT;
    if (const auto found = answer.find("recommendation"); found != answer.end() && found->is_array()) {
      run_recommendation_ = numbers(*found);
      all.recommendation = run_recommendation_.data();
    }
    std::memcpy(outcome, &all, all.struct_size);
  }
  return status_of(answer);
}

relign_status RemoteServices::measure_fields(relign_text arguments, relign_field_measures* measured) {
  const Json answer = ask(RELIGN_SERVICE_MEASURES, "fields", {{"arguments", object_of(arguments)}});
  if (status_of(answer) != RELIGN_OK) return status_of(answer);
  fields_ = {};
  for (const Json& field : answer.at("fields")) {
    fields_.name_texts.push_back(field.at("name").get<std::string>());
    fields_.mark_x_px.push_back(number_or_nan(field.at("mark_x_px")));
    fields_.mark_y_px.push_back(number_or_nan(field.at("mark_y_px")));
    fields_.tangential.push_back(number_or_nan(field.at("tangential")));
    fields_.sagittal.push_back(number_or_nan(field.at("sagittal")));
  }
  for (const std::string& name : fields_.name_texts) fields_.names.push_back({name.data(), name.size()});
  relign_field_measures all{};
  all.struct_size = static_cast<std::uint32_t>(std::min<std::size_t>(measured->struct_size, sizeof all));
  all.count = static_cast<std::uint32_t>(fields_.names.size());
  all.names = fields_.names.data();
  all.mark_x_px = fields_.mark_x_px.data();
  all.mark_y_px = fields_.mark_y_px.data();
  all.tangential = fields_.tangential.data();
  all.sagittal = fields_.sagittal.data();
  std::memcpy(measured, &all, all.struct_size);
  return RELIGN_OK;
}

relign_status RemoteServices::model_pixels(const char* call, relign_model_lens* lens, const double* pose,
                                           std::uint32_t axes, const std::uint64_t* seed, float* pixels) {
  if (!pixels) return RELIGN_BAD_ARGUMENT;
  Json arguments = {{"lens", number_of(lens)}, {"pose", values_of(pose, axes)}};
  if (seed) arguments["seed"] = *seed;
  const relign_status status = status_of(ask(RELIGN_SERVICE_MODEL, call, std::move(arguments)));
  const std::uint64_t count = std::uint64_t{model_.image_width} * model_.image_height;
  if (status == RELIGN_OK)
    std::memcpy(pixels, connection_.shared(model_offset_, count, sizeof(float)), count * sizeof(float));
  return status;
}

relign_status RemoteServices::load(const relign_text_sink* sink) {
  const Json answer = ask(RELIGN_SERVICE_PREPARED, "load");
  if (status_of(answer) != RELIGN_OK) return status_of(answer);
  if (answer.at("bytes").is_null()) return RELIGN_UNSUPPORTED;
  const auto bytes = answer.at("bytes").get<std::size_t>();
  const auto offset = answer.at("offset").get<std::size_t>();
  write(sink, bytes > 0 ? std::string(connection_.shared(offset, bytes, 1), bytes) : std::string());
  return RELIGN_OK;
}

relign_status RemoteServices::save(relign_text data) {
  const Json room = ask(RELIGN_SERVICE_PREPARED, "room", {{"bytes", data.size}});
  if (status_of(room) != RELIGN_OK) return status_of(room);
  const std::string_view bytes = {data.size > 0 ? data.data : "", static_cast<std::size_t>(data.size)};
  if (!connection_.write_shared(room.at("offset").get<std::size_t>(), bytes)) {
    why_ = "the data are larger than the sandbox allows";
    return RELIGN_BAD_ARGUMENT;
  }
  return status_of(ask(RELIGN_SERVICE_PREPARED, "save", {{"bytes", data.size}}));
}

void RemoteServices::fill_tables() {
  const auto why = [](void* context, const relign_text_sink* sink) -> relign_status {
    if (!sink) return RELIGN_BAD_ARGUMENT;
    write(sink, self(context).why_);
    return RELIGN_OK;
  };
  measures_ = {sizeof measures_, 0, this, nullptr, nullptr, why, nullptr};
  measures_.list = [](void* context, const relign_text_sink* sink) -> relign_status {
    if (!sink) return RELIGN_BAD_ARGUMENT;
    const Json answer = self(context).ask(RELIGN_SERVICE_MEASURES, "list");
    if (status_of(answer) == RELIGN_OK) write(sink, answer.at("measures").dump());
    return status_of(answer);
  };
  measures_.measure = [](void* context, relign_text name, relign_text arguments, double* value) -> relign_status {
    if (!value) return RELIGN_BAD_ARGUMENT;
    const Json answer = self(context).ask(RELIGN_SERVICE_MEASURES, "measure",
                                          {{"name", text_of(name)}, {"arguments", object_of(arguments)}});
    if (status_of(answer) == RELIGN_OK) *value = number_or_nan(answer.at("value"));
    return status_of(answer);
  };
  measures_.fields = [](void* context, relign_text arguments, relign_field_measures* measured) -> relign_status {
    return measured ? self(context).measure_fields(arguments, measured) : RELIGN_BAD_ARGUMENT;
  };
  regions_ = {sizeof regions_, kMaxRegions, this, nullptr, why};
  regions_.select = [](void* context, const std::uint32_t* numbers, std::uint32_t count) -> relign_status {
    if (!numbers && count > 0) return RELIGN_BAD_ARGUMENT;
    const PixelRegions regions = to_regions(numbers, std::min<std::size_t>(count, kMaxRegions + 1));
    return status_of(
        self(context).ask(RELIGN_SERVICE_REGIONS, "select", {{"regions", valid_json(to_json_text(regions))}}));
  };
  prior_ = {sizeof prior_, 0, this, nullptr, why};
  prior_.draw = [](void* context, std::uint64_t number, const relign_text_sink* sink) -> relign_status {
    if (!sink) return RELIGN_BAD_ARGUMENT;
    const Json answer = self(context).ask(RELIGN_SERVICE_PRIOR, "draw", {{"number", number}});
    if (status_of(answer) == RELIGN_OK) write(sink, answer.at("drawn").dump());
    return status_of(answer);
  };
  run_ = {sizeof run_, 0, this, nullptr, why};
  run_.run = [](void* context, relign_text parameter, relign_text changes, std::uint32_t steps,
                relign_run_outcome* outcome) -> relign_status {
    return outcome ? self(context).run(parameter, changes, steps, outcome) : RELIGN_BAD_ARGUMENT;
  };
  model_ = {sizeof model_, 0, this, {}, 0, 0, nullptr, nullptr, nullptr, nullptr, why};
  model_.mount = [](void* context, relign_text offsets, relign_model_lens** made) -> relign_status {
    if (!made) return RELIGN_BAD_ARGUMENT;
    const Json answer = self(context).ask(RELIGN_SERVICE_MODEL, "mount", {{"offsets", object_of(offsets)}});
    if (status_of(answer) == RELIGN_OK)
      *made = reinterpret_cast<relign_model_lens*>(answer.at("lens").get<std::uintptr_t>());
    return status_of(answer);
  };
  model_.capture = [](void* context, relign_model_lens* lens, const double* pose, std::uint32_t axes,
                      std::uint64_t seed,
                      float* pixels) { return self(context).model_pixels("capture", lens, pose, axes, &seed, pixels); };
  model_.noise_free = [](void* context, relign_model_lens* lens, const double* pose, std::uint32_t axes,
                         float* pixels) {
    return self(context).model_pixels("noise_free", lens, pose, axes, nullptr, pixels);
  };
  model_.unmount = [](void* context, relign_model_lens* lens) {
    return status_of(self(context).ask(RELIGN_SERVICE_MODEL, "unmount", {{"lens", number_of(lens)}}));
  };
  history_ = {sizeof history_, 0, this, nullptr, why};
  history_.cure_shift = [](void* context, std::uint32_t back, double* shift, std::uint32_t axes) -> relign_status {
    const std::vector<std::vector<double>>& shifts = self(context).cure_shifts_;
    if (back < 1 || back > shifts.size() || !shift || shifts[back - 1].size() != axes) {
      self(context).why_ = "expected a module from 1 to " + std::to_string(shifts.size()) + " and all axes";
      return RELIGN_BAD_ARGUMENT;
    }
    std::copy(shifts[back - 1].begin(), shifts[back - 1].end(), shift);
    return RELIGN_OK;
  };
  prepared_ = {sizeof prepared_, 0, this, 0, 0, nullptr, nullptr, why};
  prepared_.load = [](void* context, const relign_text_sink* sink) -> relign_status {
    return sink ? self(context).load(sink) : RELIGN_BAD_ARGUMENT;
  };
  prepared_.save = [](void* context, relign_text data) { return self(context).save(data); };
}

}  // namespace relign::sandbox
