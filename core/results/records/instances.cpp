#include "records/instances.h"

#include "base/json_members.h"

namespace relign::records {
namespace {

const Json* named(const Json& entries, const std::string& name) {
  for (const Json& entry : entries)
    if (text_of(entry, "name") == name) return &entry;
  return nullptr;
}

void compare_lists(const std::string& what, const Json& a, const Json& b, bool all, const std::string& in_a,
                   const std::string& in_b, std::vector<std::string>& messages) {
  for (const Json& entry : a) {
    const std::string name = text_of(entry, "name");
    const Json* other = named(b, name);
    if (!other) {
      if (all) messages.push_back(what + " '" + name + "' is only in " + in_a);
      continue;
    }
    for (const std::string& message :
         differing(entry, *other, {"plugin", "parameters", "identity", "data"}, in_a, in_b))
      messages.push_back(what + " '" + name + "', " + message);
  }
  if (!all) return;
  for (const Json& entry : b)
    if (!named(a, text_of(entry, "name")))
      messages.push_back(what + " '" + text_of(entry, "name") + "' is only in " + in_b);
}

}  // namespace

std::vector<std::string> differing(const Json& a, const Json& b, const std::vector<const char*>& keys,
                                   const std::string& in_a, const std::string& in_b) {
  std::vector<std::string> messages;
  for (const char* key : keys)
    if (member(a, key) != member(b, key))
      messages.push_back(std::string(key) + ": " + member(a, key).dump() + " in " + in_a + ", " +
                         member(b, key).dump() + " in " + in_b);
  return messages;
}

std::vector<std::string> different_scenes_and_levels(const Json& a, const Json& b, bool all, const std::string& in_a,
                                                     const std::string& in_b) {
  std::vector<std::string> messages;
  compare_lists("scene", list_of(a, "scenes"), list_of(b, "scenes"), all, in_a, in_b, messages);
  compare_lists("noise level", list_of(a, "noise_levels"), list_of(b, "noise_levels"), all, in_a, in_b, messages);
  return messages;
}

std::vector<std::string> different_instances(const Json& a, const Json& b, const std::string& in_a,
                                             const std::string& in_b) {
  std::vector<std::string> messages = differing(a, b, {"seed", "commitment"}, in_a, in_b);
  for (std::string& message : different_scenes_and_levels(a, b, false, in_a, in_b))
    messages.push_back(std::move(message));
  return messages;
}

}  // namespace relign::records
