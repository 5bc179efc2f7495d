#include "trials/pretraining_service.h"

#include "trials/service_answer.h"
#include "trials/trial_host.h"

namespace relign::trials {
namespace {

constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 30;

}  // namespace

PretrainingService::PretrainingService(ServiceContext& shared) : shared_(&shared) {
  table_.struct_size = sizeof table_;
  table_.context = this;
  if (const PretrainingState* now = state()) {
    table_.active = 1;
    table_.source = now->source;
    table_.sources = now->sources;
  }
  table_.load = [](void* context, const relign_text_sink* data) {
    return self(context).shared_->answer([&] { return self(context).load(data); });
  };
  table_.save = [](void* context, relign_text data) {
    return self(context).shared_->answer([&] { return self(context).save(data); });
  };
  table_.why = [](void* context, const relign_text_sink* sentence) {
    return tell_why(self(context).shared_, sentence);
  };
}

PretrainingState* PretrainingService::state() const {
  const auto* pretraining = std::get_if<Pretraining>(&shared_->host.setup().purpose);
  return pretraining && &shared_->view == &shared_->host ? &pretraining->state : nullptr;
}

relign_status PretrainingService::load(const relign_text_sink* data) {
  if (const PretrainingState* now = state()) {
    shared_->why = "no data: no earlier source instance has saved any";
    return now->bytes ? write_text(data, *now->bytes) : RELIGN_UNSUPPORTED;
  }
  const PreparedByIdentity& prepared = shared_->host.setup().prepared;
  const auto found = prepared.find(shared_->view.algorithm().identity);
  const bool known = found != prepared.end();
  if (known && found->second.bytes) return write_text(data, *found->second.bytes);
  if (known && !found->second.failure.empty()) {
    shared_->why = found->second.failure;
    return RELIGN_FAILED;
  }
  shared_->why = "no pretrained data for this trial";
  return RELIGN_UNSUPPORTED;
}

relign_status PretrainingService::save(relign_text data) {
  PretrainingState* now = state();
  if (!now) return shared_->refuse("cannot save in a benchmark trial, only in pretraining on a source instance");
  if (data.size > kMaxBytes)
    return shared_->refuse("found " + std::to_string(data.size) + " bytes; expected at most 1 GiB");
  if (!data.data && data.size > 0) return shared_->refuse("'data' is null");
  now->bytes = std::make_shared<const std::string>(text_of(data));
  return RELIGN_OK;
}

}  // namespace relign::trials
