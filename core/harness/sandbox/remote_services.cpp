#include "sandbox/remote_services.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/error.h"
#include "base/json_members.h"
#include "base/pixel_region.h"
#include "plugin_host/process_child.h"

namespace relign::sandbox {
namespace {

std::string to_json(relign_text text) {
  return text.data ? std::string(text.data, static_cast<std::size_t>(text.size)) : std::string();
}

// JSON that a plugin wrote; the host refuses what is none.
Json object_of(relign_text text) {
  const std::string given = to_json(text);
  if (given.empty()) return Json::object();
  Json object = parsed_json(given);
  return object.is_discarded() ? Json(given) : object;
}

void write(const relign_text_sink* sink, const std::string& text) {
  sink->write(sink->context, {text.data(), text.size()});
}

// Lenses are numbers in messages and pointers in the table; the host counts from 1.
std::uint64_t number_of(const relign_model_lens* lens) { return reinterpret_cast<std::uintptr_t>(lens); }

relign_model_lens* lens_of(const Json& number) {
  return reinterpret_cast<relign_model_lens*>(number.get<std::uintptr_t>());
}

double number_or_nan(const Json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

std::vector<double> to_json(const double* values, std::uint32_t count) {
  return values ? std::vector<double>(values, values + count) : std::vector<double>();
}

Json to_json(const std::uint32_t* values, std::uint32_t count) {
  return values ? Json(std::vector<std::uint32_t>(values, values + count)) : Json::array();
}

// One more region than any host accepts is enough to be refused.
Json regions_of(const std::uint32_t* values, std::uint32_t count) {
  if (!values && count > 0) return nullptr;
  return valid_json(to_json_text(to_regions(values, std::min<std::size_t>(count, kMaxRegions + 1))));
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

RemoteServices::RemoteServices(Connection& connection, const Json& task)
    : connection_(connection), axes_(task.at("axes").size()) {
  if (const auto image = task.find("image"); image != task.end()) {
    width_ = image->at("width").get<std::uint32_t>();
    height_ = image->at("height").get<std::uint32_t>();
  }
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

Json RemoteServices::ask(const char* service, const char* call, Json::initializer_list_t arguments) {
  if (std::this_thread::get_id() != thread_) return {{"message", "refused"}};
  Json request = Json::object(arguments);
  request["message"] = "service";
  request["service"] = service;
  request["call"] = call;
  connection_.send(request);
  Json answer = connection_.receive();
  why_ = relign::text_of(answer, "text");
  return answer;
}

relign_text RemoteServices::keep(const std::string& name, std::string text) {
  const std::string& kept = kept_[name] = std::move(text);
  return {kept.data(), kept.size()};
}

bool RemoteServices::has_axes(std::uint32_t axes) {
  if (axes != axes_) why_ = "expected room for one number per axis";
  return axes == axes_;
}

void RemoteServices::take(const Json& list, double* values, std::uint32_t axes) {
  const std::vector<double> taken = numbers(list);
  if (taken.size() != axes) throw Error(ErrorKind::bad_input, "the host sent another number of axes");
  std::copy(taken.begin(), taken.end(), values);
}

void RemoteServices::take(const Json& place, float* pixels, std::uint64_t count) {
  std::memcpy(pixels, connection_.shared(place.at("offset").get<std::size_t>(), count, sizeof(float)),
              count * sizeof(float));
}

std::string RemoteServices::bytes(const Json& place) {
  const auto count = place.at("bytes").get<std::size_t>();
  return count > 0 ? std::string(connection_.shared(place.at("offset").get<std::size_t>(), count, 1), count) : "";
}

relign_status RemoteServices::put(relign_text data) {
  const Json answer = ask(RELIGN_SERVICE_PREPARED, "room", {{"bytes", data.size}});
  if (status_of(answer) != RELIGN_OK) return status_of(answer);
  const std::string_view bytes = {data.size > 0 ? data.data : "", static_cast<std::size_t>(data.size)};
  if (connection_.write_shared(answer.at("room").at("offset").get<std::size_t>(), bytes)) return RELIGN_OK;
  why_ = "the data are larger than the sandbox allows";
  return RELIGN_BAD_ARGUMENT;
}

const double* Columns::numbers(const Json& list, const char* name) {
  std::vector<double>& column = numbers_.emplace_back();
  for (const Json& row : list) column.push_back(number_or_nan(row.at(name)));
  return column.data();
}

const relign_text* Columns::texts(const Json& list, const char* name) {
  std::vector<std::string>& strings = strings_.emplace_back();
  for (const Json& row : list) strings.push_back(row.at(name).get<std::string>());
  std::vector<relign_text>& column = texts_.emplace_back();
  for (const std::string& text : strings) column.push_back({text.data(), text.size()});
  return column.data();
}

const relign_reference_service* RemoteServices::reference(relign_reference_service& table) {
  if (!reference_.pixels) {
    connection_.send_line("{\"message\":\"reference\"}\n");
    if (status_of(connection_.receive()) != RELIGN_OK) return nullptr;
  }
  reference_ = image_at(std::size_t{width_} * height_ * sizeof(float));
  table.image = &reference_;
  return &table;
}

relign_status RemoteServices::run(relign_text parameter, relign_text changes, std::uint32_t steps,
                                  relign_run_outcome* outcome) {
  const Json answer = ask(RELIGN_SERVICE_RUN, "run",
                          {{"parameter", to_json(parameter)}, {"parameters", object_of(changes)}, {"steps", steps}});
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

namespace {

bool open(RemoteServices& remote, relign_reference_service& table) { return remote.reference(table) != nullptr; }

bool open(RemoteServices& remote, relign_run_service& table) {
  table.run = [](void* context, relign_text parameter, relign_text changes, std::uint32_t steps,
                 relign_run_outcome* outcome) -> relign_status {
    return outcome ? RemoteServices::self(context).run(parameter, changes, steps, outcome) : RELIGN_BAD_ARGUMENT;
  };
  return status_of(remote.ask(RELIGN_SERVICE_RUN, "open", {})) == RELIGN_OK;
}

#include "remote_messages.inc"

}  // namespace

const void* RemoteServices::get(std::string_view id) {
  return plugin_host::find_service(tables, id, [&](auto& table) {
    table.struct_size = sizeof table;
    table.context = this;
    return open(*this, table);
  });
}

}  // namespace relign::sandbox
