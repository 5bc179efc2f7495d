#include "records/replays.h"

#include "base/error.h"
#include "base/files.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "records/line_files.h"
#include "records/manifest.h"
#include "records/record.h"
#include "records/results_folder.h"

namespace relign::records {
namespace fs = std::filesystem;

namespace {

constexpr const char* kFile = "verify.json";
constexpr std::size_t kMaxBytes = 4'000'000;

Json to_json(const ReplayCounts& counts) {
  return {{"recorded", counts.recorded}, {"replayed", counts.replayed}, {"equal", counts.equal}};
}

ReplayCounts counts_of(const Json& json) {
  return {count_of(json, "recorded"), count_of(json, "replayed"), count_of(json, "equal")};
}

}  // namespace

std::string hash_of_records(const fs::path& folder) {
  Json manifest = read_manifest_json(folder);
  if (manifest.is_object()) manifest.erase("secret");
  std::string text = sha256_hex(canonical_json(manifest)) + "  manifest.json\n";
  for (const fs::path& file : line_files(folder / "trials"))
    text += sha256_file(file) + "  trials/" + file.filename().string() + "\n";
  return sha256_hex(text);
}

void write_replays(const fs::path& folder, const Replays& replays, Json details) {
  details.update(to_json(replays.all));
  details["format"] = kFormat;
  details["records"] = hash_of_records(folder);
  details["by"] = replays.by;
  details["program"] = replays.program;
  details["date"] = replays.date;
  details["methods"] = Json::array();
  for (const auto& [method, counts] : replays.methods) {
    Json entry = to_json(counts);
    entry["name"] = method.first;
    entry["protocol"] = method.second;
    details["methods"].push_back(std::move(entry));
  }
  write_file_atomically(folder / kFile, details.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

std::optional<Replays> read_replays(const fs::path& folder) {
  std::error_code code;
  if (!fs::is_regular_file(folder / kFile, code)) return std::nullopt;
  Json stated;
  try {
    stated = parsed_json(read_file(folder / kFile, kMaxBytes));
  } catch (const Error&) {
    return std::nullopt;
  }
  if (!stated.is_object() || text_of(stated, "records").empty() ||
      text_of(stated, "records") != hash_of_records(folder))
    return std::nullopt;
  Replays replays;
  replays.all = counts_of(stated);
  replays.by = text_of(stated, "by");
  replays.program = text_of(stated, "program");
  replays.date = text_of(stated, "date");
  for (const Json& entry : list_of(stated, "methods"))
    replays.methods[{text_of(entry, "name"), text_of(entry, "protocol")}] = counts_of(entry);
  return replays;
}

}  // namespace relign::records
