#include "runner/pretraining_store.h"

#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "base/hash.h"

namespace relign::runner {
namespace {

constexpr int kStoreFormat = 1;

}  // namespace

PretrainingStore::PretrainingStore(const std::filesystem::path& cache, const std::string& plugin, Json key)
    : key_(std::move(key)) {
  if (cache.empty()) return;
  const std::string name = short_hash(canonical_json(key_));
  data_file_ = cache / "prepared" / plugin / (name + ".data");
  sidecar_ = cache / "prepared" / plugin / (name + ".json");
}

trials::PretrainingData PretrainingStore::read(std::string& problem) const {
  problem.clear();
  std::error_code code;
  const bool data_there = std::filesystem::exists(data_file_, code);
  if (!keeps() || (!data_there && !std::filesystem::exists(sidecar_, code))) return {};
  const auto refuse = [&problem](const std::string& sentence) {
    problem = sentence;
    return trials::PretrainingData{};
  };
  try {
    const Json side = parsed_json(read_file(sidecar_));
    if (!side.is_object()) return refuse(sidecar_.string() + " is not a JSON object");
    if (side.value("format", Json()) != kStoreFormat) return refuse(sidecar_.string() + " has another format");
    if (side.value("key", Json()) != key_) return refuse(sidecar_.string() + " has another key");
    trials::PretrainingData data;
    data.bytes = std::make_shared<const std::string>(read_file(data_file_));
    data.hash = sha256_hex(*data.bytes);
    if (side.value("sha256", Json()) != data.hash) return refuse(data_file_.string() + " is damaged");
    return data;
  } catch (const Error& error) {
    return refuse(error.what());
  }
}

void PretrainingStore::write(const trials::PretrainingData& data, const Json& made) const {
  if (!keeps()) return;
  write_file_atomically(data_file_, *data.bytes);
  const Json sidecar = {
      {"format", kStoreFormat}, {"key", key_}, {"sha256", data.hash}, {"bytes", data.bytes->size()}, {"made", made}};
  write_file_atomically(sidecar_, sidecar.dump(2) + "\n");
}

}  // namespace relign::runner
