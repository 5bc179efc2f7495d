#include "plugin_host/process_services.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string_view>

#include "base/pixel_region.h"
#include "plugin_host/guard.h"
#include "plugin_host/process_child.h"

namespace relign::plugin_host {
namespace {

constexpr const char* kNoMemoryForData = "the host has not enough memory for the shared data";
constexpr std::uint64_t kMaxDataBytes = std::uint64_t{1} << 30;  // as services.toml states for relign.prepared/1

// Ends a request with this answer.
struct Unusable {
  Json answer;
};

Json refused(const std::string& text) { return {{"message", "refused"}, {"text", text}}; }
Json failed(const std::string& text) { return {{"message", "failed"}, {"text", text}}; }

Json unsupported(const std::string& text) { return {{"message", "unsupported"}, {"text", text}}; }

Json result(Json::initializer_list_t members) {
  Json answer = Json::object(members);
  answer["message"] = "result";
  return answer;
}

relign_text view(const std::string& text) { return {text.data(), text.size()}; }
std::string to_string(relign_text text) { return {text.data, static_cast<std::size_t>(text.size)}; }

template <class List>
std::uint32_t count_of(const List& list) {
  return static_cast<std::uint32_t>(list.size());
}

template <class Struct>
Struct empty() {
  Struct made{};
  made.struct_size = sizeof made;
  return made;
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

Json answer(ProcessServices& in, const relign_reference_service&) { return in.unknown_call(); }

Json answer(ProcessServices& in, const relign_run_service& run) {
  if (in.call() == "open") return result({});
  if (in.call() != "run") return in.unknown_call();
  const auto steps = in.integer<std::uint32_t>("steps");
  const std::string parameter = in.text("parameter"), parameters = in.object("parameters");
  auto outcome = empty<relign_run_outcome>();
  const relign_status status = run.run(run.context, view(parameter), view(parameters), steps, &outcome);
  Json reply = status == RELIGN_OK ? result({}) : in.failure(status);
  if (status != RELIGN_OK && status != RELIGN_FAILED) return reply;
  // Also after a failure, because the other algorithm has moved the stage.
  reply["steps"] = outcome.steps;
  reply["last"] = to_json(outcome.last, in.axes());
  if (outcome.last && outcome.last->image) in.share_image(*outcome.last->image);
  if (status != RELIGN_OK) return reply;
  reply["end"] = outcome.end == RELIGN_RUN_FINISHED ? "finished" : "steps_spent";
  reply["best"] = to_json(outcome.best, in.axes());
  reply["recommendation"] = nullptr;
  if (outcome.recommendation)
    reply["recommendation"] = std::vector<double>(outcome.recommendation, outcome.recommendation + in.axes());
  return reply;
}

#include "host_messages.inc"

}  // namespace

ProcessServices::ProcessServices(const relign_trial& trial, SharedPixels& pixels, std::size_t image_bytes)
    : trial_(trial), pixels_(pixels), image_bytes_(image_bytes) {}

Json ProcessServices::answer(const Json& request) {
  request_ = &request;
  const std::string id = text("service");
  const void* table = service(id.c_str());
  if (const std::string word = missing_word(id, trial_.task->observes); !table && !word.empty())
    return unsupported("the service " + id + " is not granted: declare \"" + word +
                       "\" under \"observes\" in the manifest");
  if (!table) return unsupported("'" + id + "' is not offered to this algorithm");
  try {
    return dispatch(*this, id, table);
  } catch (const Unusable& unusable) {
    return unusable.answer;
  }
}

const void* ProcessServices::service(const char* id) const {
  return trial_.get_service ? trial_.get_service(trial_.context, {id, std::strlen(id)}) : nullptr;
}

Json ProcessServices::unknown_call() const { return unsupported("'" + call() + "' is not offered to this algorithm"); }

Json ProcessServices::failure(relign_status status) const {
  if (status == RELIGN_STOP) return {{"message", "stop"}};
  TextSink reason;
  trial_.why(trial_.context, reason.sink());
  const char* name = status == RELIGN_FAILED ? "failed" : status == RELIGN_UNSUPPORTED ? "unsupported" : "refused";
  return {{"message", name}, {"text", reason.text()}};
}

// ---- arguments --------------------------------------------------------------------------------

std::string ProcessServices::text(const char* member) const {
  const auto found = request_->find(member);
  return found != request_->end() && found->is_string() ? found->get<std::string>() : "";
}

std::string ProcessServices::object(const char* member) const {
  const auto found = request_->find(member);
  return found == request_->end() ? "{}" : found->dump();
}

template <class Integer>
Integer ProcessServices::integer(const char* member) const {
  const auto found = request_->find(member);
  if (found == request_->end() || !found->is_number_unsigned() ||
      found->get<std::uint64_t>() > std::numeric_limits<Integer>::max())
    throw Unusable{refused("expected an integer '" + std::string(member) + "' from 0 to " +
                           std::to_string(std::numeric_limits<Integer>::max()))};
  return found->get<Integer>();
}

std::vector<double> ProcessServices::numbers(const char* member) const {
  std::vector<double> values;
  if (const auto given = request_->find(member); given != request_->end() && given->is_array())
    for (const Json& value : *given)
      values.push_back(value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN());
  return values;
}

std::vector<std::uint32_t> ProcessServices::regions(const char* member) const {
  try {
    return to_numbers(read_regions(request_->value(member, Json())));
  } catch (const Error& error) {
    throw Unusable{refused(error.what())};
  }
}

std::vector<std::uint32_t> ProcessServices::counts(const char* member) const {
  constexpr std::size_t kMost = 1000;
  const auto found = request_->find(member);
  const bool usable =
      found != request_->end() && found->is_array() && found->size() <= kMost &&
      std::all_of(found->begin(), found->end(), [](const Json& value) {
        return value.is_number_unsigned() && value.get<std::uint64_t>() <= std::numeric_limits<std::uint32_t>::max();
      });
  if (!usable)
    throw Unusable{refused("expected a list '" + std::string(member) + "' of at most " + std::to_string(kMost) +
                           " non-negative integers")};
  return found->get<std::vector<std::uint32_t>>();
}

relign_model_lens* ProcessServices::lens(const char* member) const {
  const auto number = request_->find(member);
  const auto known = number != request_->end() && number->is_number_unsigned()
                         ? lenses_.find(number->get<std::uint64_t>())
                         : lenses_.end();
  if (known == lenses_.end()) throw Unusable{refused("this lens is not mounted")};
  return known->second;
}

relign_text ProcessServices::bytes(const char* member) const {
  const auto count = integer<std::uint64_t>(member);
  if (count > data_room_) throw Unusable{refused("request 'room' first; its answer has the offset of the data")};
  return {count > 0 ? reinterpret_cast<const char*>(pixels_.at(data_offset())) : "", count};
}

// ---- results ----------------------------------------------------------------------------------

std::uint64_t ProcessServices::keep(relign_model_lens* lens) {
  lenses_[++lenses_made_] = lens;
  return lenses_made_;
}

void ProcessServices::forget(relign_model_lens* lens) {
  const auto found =
      std::find_if(lenses_.begin(), lenses_.end(), [&](const auto& known) { return known.second == lens; });
  if (found != lenses_.end()) lenses_.erase(found);
}

void ProcessServices::share_image(const relign_image& image) {
  if (image_bytes_ > 0) pixels_.put(image, 0, image_bytes_);
}

// Behind the trial's images, which must not change while the model works.
float* ProcessServices::pixels(std::uint32_t width, std::uint32_t height, std::size_t images) {
  const std::size_t offset = 2 * image_bytes_;
  if (images > 1) data_room_ = 0;
  if (!pixels_.grow(offset + images * width * height * sizeof(float))) throw Unusable{failed(kNoMemoryForPixels)};
  return pixels_.at(offset);
}

Json ProcessServices::place_of_pixels() const {
  return {{"file", ChildProcess::pixel_path()}, {"offset", 2 * image_bytes_}};
}

// Behind the model's image, so that neither overwrites the other.
std::size_t ProcessServices::data_offset() const {
  const auto* model = static_cast<const relign_model_service*>(service(RELIGN_SERVICE_MODEL));
  return 2 * image_bytes_ + (model ? std::size_t{model->image_width} * model->image_height * sizeof(float) : 0);
}

Json ProcessServices::place_of_data(std::size_t bytes) const {
  return {{"bytes", bytes}, {"file", ChildProcess::pixel_path()}, {"offset", data_offset()}};
}

Json ProcessServices::room() {
  const auto* prepared = static_cast<const relign_prepared_service*>(service(RELIGN_SERVICE_PREPARED));
  const auto count = integer<std::uint64_t>("bytes");
  if (!prepared || !prepared->active) return refused("cannot save in a benchmark trial, only in pretraining");
  if (count > kMaxDataBytes) return refused("found " + std::to_string(count) + " bytes; expected at most 1 GiB");
  if (!pixels_.grow(data_offset() + count)) return failed(kNoMemoryForData);
  data_room_ = count;
  return result({{"room", place_of_data(count)}});
}

Json ProcessServices::give(const std::string& data) {
  if (!pixels_.grow(data_offset() + data.size())) throw Unusable{failed(kNoMemoryForData)};
  if (!data.empty()) std::memcpy(pixels_.at(data_offset()), data.data(), data.size());
  return place_of_data(data.size());
}

}  // namespace relign::plugin_host
