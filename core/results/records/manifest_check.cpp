#include "records/manifest_check.h"

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/commitment.h"
#include "base/error.h"
#include "base/hash.h"
#include "base/json_members.h"
#include "base/text.h"

namespace relign::records {
namespace {

// The suite texts of a folder as JSON; without any, one without members.
std::vector<Json> suites_of(std::vector<std::string>& found, const Json& manifest) {
  std::vector<std::string> texts;
  for (const Json& suite : list_of(manifest, "suites")) texts.push_back(text_of(suite, "text"));
  if (texts.empty()) texts.push_back(text_of(manifest, "suite"));
  std::vector<Json> suites;
  for (const std::string& text : texts) {
    suites.push_back(text.empty() ? Json::object() : Json::parse(text, nullptr, false));
    if (suites.back().is_object()) continue;
    found.push_back("the text of the suite is not a JSON object");
    suites.pop_back();
  }
  return suites;
}

void check_commitment(std::vector<std::string>& found, const Json& suite, const std::string& commitment) {
  const std::string stated = text_of(suite, "commitment");
  if (stated == commitment) return;
  if (stated.empty())
    found.push_back("the suite is open, since it has no commitment, but 'commitment' is " + in_quotes(commitment));
  else
    found.push_back("the suite has the commitment " + in_quotes(stated) + ", but 'commitment' is " +
                    in_quotes(commitment));
}

void check_secret(std::vector<std::string>& found, const Json& manifest, const std::string& commitment) {
  if (!manifest.contains("secret")) return;
  if (commitment.empty()) {
    found.push_back("there is a 'secret', but no commitment");
  } else if (const std::string own = commitment_to(text_of(manifest, "secret")); own != commitment) {
    found.push_back("'secret' has the commitment " + in_quotes(own) + ", but 'commitment' is " + in_quotes(commitment));
  }
}

void check_number(std::vector<std::string>& found, const Json& suite, const Json& manifest, const char* key) {
  if (suite.contains(key) && manifest.contains(key) && count_of(suite, key) != count_of(manifest, key))
    found.push_back(in_quotes(key) + " is " + std::to_string(count_of(suite, key)) + " in the suite and " +
                    std::to_string(count_of(manifest, key)) + " in the manifest");
}

void check_lists(std::vector<std::string>& found, const Json& suite, const Json& manifest) {
  for (const char* key : {"scenes", "noise_levels", "algorithms"}) {
    const Json& here = list_of(manifest, key);
    const auto listed = static_cast<std::size_t>(
        std::count_if(here.begin(), here.end(), [](const Json& entry) { return !flag_of(entry, "added"); }));
    // An entry of the suite may stand for several methods, and a merged folder has those of several suites.
    const std::size_t in_suite = list_of(suite, key).size();
    if (!manifest.contains(key) || in_suite == 0) continue;
    if (std::string_view(key) == "algorithms" ? listed < in_suite : listed != in_suite)
      found.push_back("the suite has " + std::to_string(in_suite) + " " + in_quotes(key) + ", the manifest " +
                      std::to_string(listed));
  }
}

// The suite's plan is in the manifest with defaults filled in; a merged folder has that of its first suite.
void check_analysis(std::vector<std::string>& found, const Json& suite, const Json& manifest) {
  const Json &written = object_of(suite, "analysis"), &plan = object_of(manifest, "analysis");
  if (written.empty() != plan.empty()) {
    found.push_back(plan.empty() ? "the suite has an analysis plan, the manifest has none"
                                 : "the manifest has an analysis plan, the suite has none");
    return;
  }
  for (const auto& [key, value] : written.items())
    if (member(plan, key.c_str()) != value)
      found.push_back(in_quotes(key) + " of the analysis plan is " + value.dump() + " in the suite and " +
                      member(plan, key.c_str()).dump() + " in the manifest");
  if (!plan.empty() && text_of(manifest, "analysis_hash") != sha256_hex(canonical_json(plan)))
    found.push_back("'analysis_hash' is not the SHA-256 of the analysis plan");
}

void check_order(std::vector<std::string>& found, const Json& manifest) {
  if (!manifest.contains("order") || !manifest.contains("trials")) return;
  const Json& order = list_of(manifest, "order");
  std::set<std::string> ids;
  for (const Json& id : order)
    if (id.is_string()) ids.insert(id.get<std::string>());
  if (ids.size() != order.size()) found.push_back("'order' repeats " + counted(order.size() - ids.size(), "trial"));
  if (order.size() != count_of(manifest, "trials"))
    found.push_back("'trials' is " + std::to_string(count_of(manifest, "trials")) + ", but 'order' has " +
                    std::to_string(order.size()));
}

}  // namespace

void refuse_contradictions(const std::vector<std::string>& found, const std::filesystem::path& folder) {
  if (found.empty()) return;
  throw Error(ErrorKind::bad_input, "'" + (folder / "manifest.json").string() +
                                        "' contradicts its suite, so that these results cannot be trusted:\n  " +
                                        join(found, "\n  "));
}

void require_consistent(const Json& manifest, const std::filesystem::path& folder) {
  std::vector<std::string> found;
  const std::string commitment = text_of(manifest, "commitment");
  const std::vector<Json> suites = suites_of(found, manifest);
  for (const Json& suite : suites) {
    check_commitment(found, suite, commitment);
    check_number(found, suite, manifest, "instances");
    check_number(found, suite, manifest, "first_instance");
    check_lists(found, suite, manifest);
  }
  if (!suites.empty()) {  // others may differ in these
    check_number(found, suites.front(), manifest, "seed");
    check_analysis(found, suites.front(), manifest);
    if (const Json& written = member(suites.front(), "spec"), &stated = member(manifest, "spec");
        manifest.contains("spec") && written != stated)
      found.push_back("'spec' is " + written.dump() + " in the suite and " + stated.dump() + " in the manifest");
  }
  check_secret(found, manifest, commitment);
  check_order(found, manifest);
  refuse_contradictions(found, folder);
}

}  // namespace relign::records
