#include "trials/prepared_service.h"

#include "trials/conversation.h"
#include "trials/service_answer.h"

namespace relign::trials {
namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 30;

}  // namespace

PreparedService::PreparedService(ServiceSite& site) : site_(&site) {
  table_.struct_size = sizeof table_;
  table_.context = this;
  if (const Preparing* now = preparing()) {
    table_.preparing = 1;
    table_.source = now->source;
    table_.sources = now->sources;
  }
  table_.load = [](void* context, const relign_text_sink* data) {
    return self(context).site_->answer([&] { return self(context).load(data); });
  };
  table_.save = [](void* context, relign_text data) {
    return self(context).site_->answer([&] { return self(context).save(data); });
  };
  table_.why = [](void* context, const relign_text_sink* sentence) { return tell_why(self(context).site_, sentence); };
}

Preparing* PreparedService::preparing() const {
  return &site_->seat == &site_->host ? site_->host.setup().preparing : nullptr;
}

relign_status PreparedService::load(const relign_text_sink* data) {
  if (const Preparing* now = preparing()) {
    site_->why = "no source before this one has saved anything";
    return now->bytes ? write_text(data, *now->bytes) : RELIGN_UNSUPPORTED;
  }
  const PreparedByIdentity* prepared = site_->host.setup().prepared;
  const auto found = prepared ? prepared->find(site_->seat.algorithm().identity) : PreparedByIdentity::const_iterator();
  const bool known = prepared && found != prepared->end();
  if (known && found->second.bytes) return write_text(data, *found->second.bytes);
  if (known && !found->second.failure.empty()) {
    site_->why = found->second.failure;
    return RELIGN_FAILED;
  }
  site_->why = "nothing was prepared for this trial";
  return RELIGN_UNSUPPORTED;
}

relign_status PreparedService::save(relign_text data) {
  Preparing* now = preparing();
  if (!now) return site_->refuse("this is a trial: only a conversation on a source instance may save");
  if (data.size > kMostBytes) return site_->refuse("more than 1 GiB");
  if (!data.data && data.size > 0) return site_->refuse("there are no bytes");
  now->bytes = std::make_shared<const std::string>(text_of(data));
  return RELIGN_OK;
}

}  // namespace relign::trials
