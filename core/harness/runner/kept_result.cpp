#include "runner/kept_result.h"

#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/machine.h"
#include "plugin_host/objects.h"
#include "runner/provenance.h"

namespace relign::runner {
namespace {

constexpr int kKeptFormat = 1;  // increase it when the same key would give another result

std::string digest_of(const Json& value) { return sha256_hex(canonical_json(value)); }

}  // namespace

KeptResult::KeptResult(const std::filesystem::path& cache, const std::string& kind, Json key) : key_(std::move(key)) {
  if (!cache.empty()) file_ = cache / kind / (short_hash(canonical_json(key_)) + ".json");
}

Json KeptResult::read() const {
  std::error_code code;
  if (file_.empty() || !std::filesystem::is_regular_file(file_, code)) return nullptr;
  try {
    const Json kept = parsed_json(read_file(file_));
    if (!kept.is_object() || kept.value("format", Json()) != kKeptFormat || kept.value("key", Json()) != key_)
      return nullptr;
    Json value = kept.value("value", Json());
    return text_of(kept, "sha256") == digest_of(value) ? value : Json();
  } catch (const std::exception&) {
    return nullptr;
  }
}

void KeptResult::write(const Json& value) const noexcept {
  if (file_.empty() || value.is_null()) return;
  try {
    const Json kept = {{"format", kKeptFormat}, {"key", key_}, {"sha256", digest_of(value)}, {"value", value}};
    write_file_atomically(file_, kept.dump() + "\n");
  } catch (const std::exception&) {
  }
}

Json key_of_scene(const PreparedPlan& prepared, std::size_t scene) {
  const plugin_host::Choice& choice = prepared.plan.suite.scenes.at(scene).choice;
  Json key = {{"plugin", plugin_host::plugin_hash(*choice.plugin)},
              {"scene", choice.identity},
              {"data", prepared.scene_identity.at(scene)}};
  if (reproducible_of(choice) != "anywhere") key["instruction_sets"] = instruction_sets();
  return key;
}

}  // namespace relign::runner
