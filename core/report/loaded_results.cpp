#include "report/loaded_results.h"

#include <algorithm>

#include "base/error.h"
#include "records/results_folder.h"

namespace relign::report {
namespace {

namespace fs = std::filesystem;

// Takes the list out of the manifest. Sorted.
std::vector<std::string> take_order(Json& manifest) {
  std::vector<std::string> planned;
  const auto order = manifest.find("order");
  if (order == manifest.end()) return planned;
  if (order->is_array())
    for (Json& id : *order)
      if (id.is_string()) planned.push_back(std::move(id.get_ref<std::string&>()));
  manifest.erase(order);
  std::sort(planned.begin(), planned.end());
  planned.erase(std::unique(planned.begin(), planned.end()), planned.end());
  return planned;
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
  results.manifest = records::read_manifest(folder);
  const std::vector<std::string> planned = take_order(results.manifest);
  results.planned = planned.size();
  stats::ReadTable read = stats::read_trial_table(folder, [&](const std::string& trial) {
    return planned.empty() || std::binary_search(planned.begin(), planned.end(), trial);
  });
  results.trials = std::move(read.table);
  results.incomplete = std::move(read.incomplete);
  results.from_other_plans = read.left_out;
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
