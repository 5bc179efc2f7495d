#include "report/loaded_results.h"

#include <algorithm>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "records/results_folder.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

Json read_manifest(const fs::path& path) {
  Json manifest = JsonSource::from_file(path).root();
  if (!manifest.is_object())
    throw Error(ErrorKind::bad_input, path.string() + ": this is no results manifest (an object was expected)");
  records::check_format(manifest, path.string());
  return manifest;
}

}  // namespace

LoadedResults load_results(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) throw Error(ErrorKind::io, folder.string() + ": there is no such folder");
  const fs::path manifest_path = folder / "manifest.json";
  if (!fs::exists(manifest_path, ignored))
    throw Error(ErrorKind::bad_input, folder.string() +
                                          ": this folder holds no results (it has no manifest.json); "
                                          "'relign-bench run SUITE -o FOLDER' makes one");

  LoadedResults results;
  results.folder = folder;
  results.manifest = read_manifest(manifest_path);

  std::set<std::string> planned;
  for (const Json& id : list_of(results.manifest, "order"))
    if (id.is_string()) planned.insert(id.get<std::string>());
  const auto belongs = [&](const std::string& id) { return planned.empty() || planned.count(id) > 0; };

  std::vector<std::string> incomplete;
  std::set<std::string> seen;
  if (fs::is_directory(folder / "trials", ignored)) {
    for (records::TrialRecord& trial :
         records::read_trials(folder, [&](const std::string& id) { incomplete.push_back(id); })) {
      if (!belongs(trial.trial))
        ++results.from_other_plans;
      else if (seen.insert(trial.trial).second)
        results.trials.push_back(std::move(trial));
    }
  }
  std::set<std::string> listed;
  for (const std::string& id : incomplete)
    if (belongs(id) && seen.count(id) == 0 && listed.insert(id).second) results.incomplete.push_back(id);
  if (fs::is_directory(folder / "times", ignored))
    for (records::TrialTimes& times : records::read_times(folder))
      if (seen.count(times.trial) > 0) results.times.push_back(std::move(times));
  return results;
}

std::string text_of(const Json& object, const char* key) {
  if (!object.is_object()) return "";
  const auto found = object.find(key);
  if (found == object.end() || found->is_null()) return "";
  return found->is_string() ? found->get<std::string>() : found->dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::uint64_t count_of(const Json& object, const char* key) {
  if (!object.is_object()) return 0;
  const auto found = object.find(key);
  return found != object.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
}

bool flag_of(const Json& object, const char* key) {
  if (!object.is_object()) return false;
  const auto found = object.find(key);
  return found != object.end() && found->is_boolean() && found->get<bool>();
}

const Json& list_of(const Json& object, const char* key) {
  static const Json kNone = Json::array();
  if (!object.is_object()) return kNone;
  const auto found = object.find(key);
  return found != object.end() && found->is_array() ? *found : kNone;
}

const Json& object_of(const Json& object, const char* key) {
  static const Json kNone = Json::object();
  if (!object.is_object()) return kNone;
  const auto found = object.find(key);
  return found != object.end() && found->is_object() ? *found : kNone;
}

}  // namespace relign::report
