#include "records/manifest_check.h"

#include <set>
#include <string>
#include <vector>

#include "base/commitment.h"
#include "base/error.h"
#include "base/json_members.h"
#include "base/text.h"

namespace relign::records {
namespace {

std::string in_quotes(const std::string& text) { return "'" + text + "'"; }

// The suites of a folder as JSON; a text that cannot be read is null.
std::vector<Json> suites_of(const Json& manifest) {
  std::vector<std::string> texts;
  for (const Json& suite : list_of(manifest, "suites")) texts.push_back(text_of(suite, "text"));
  if (texts.empty()) texts.push_back(text_of(manifest, "suite"));
  std::vector<Json> suites;
  for (const std::string& text : texts) {
    if (text.empty()) continue;
    try {
      suites.push_back(parsed_json(text));
    } catch (const Error&) {
      suites.emplace_back();
    }
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

void check_numbers(std::vector<std::string>& found, const Json& suite, const Json& manifest) {
  for (const char* key : {"seed", "instances", "first_instance"})
    if (suite.contains(key) && manifest.contains(key) && count_of(suite, key) != count_of(manifest, key))
      found.push_back(in_quotes(key) + " is " + std::to_string(count_of(suite, key)) + " in the suite and " +
                      std::to_string(count_of(manifest, key)) + " in the manifest");
  for (const char* key : {"scenes", "noise_levels"})
    if (const std::size_t in_suite = list_of(suite, key).size(), here = list_of(manifest, key).size();
        manifest.contains(key) && in_suite > 0 && in_suite != here)
      found.push_back("the suite has " + std::to_string(in_suite) + " " + in_quotes(key) + ", the manifest " +
                      std::to_string(here));
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

void require_consistent(const Json& manifest, const std::filesystem::path& folder) {
  std::vector<std::string> found;
  const std::string commitment = text_of(manifest, "commitment");
  for (const Json& suite : suites_of(manifest)) {
    if (!suite.is_object()) continue;
    check_commitment(found, suite, commitment);
    check_numbers(found, suite, manifest);
  }
  check_secret(found, manifest, commitment);
  check_order(found, manifest);
  if (found.empty()) return;
  throw Error(ErrorKind::bad_input, "'" + (folder / "manifest.json").string() +
                                        "' contradicts itself, so that these results cannot be trusted:\n  " +
                                        join(found, "\n  "));
}

}  // namespace relign::records
