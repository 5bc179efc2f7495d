#include "records/instances.h"

namespace relign::records {
namespace {

template <class Entry>
void compare_lists(const std::string& what, const std::vector<Entry>& a, const std::vector<Entry>& b, bool all,
                   const std::string& in_a, const std::string& in_b, std::vector<std::string>& messages) {
  for (const Entry& entry : a) {
    if (const Entry* other = entry_with_key(b, entry.key())) {
      for (const std::string& message :
           differing(entry, *other, {"plugin", "parameters", "identity", "data"}, in_a, in_b))
        messages.push_back(what + " '" + entry.name + "', " + message);
    } else if (all) {
      messages.push_back(what + " '" + entry.name + "' is only in " + in_a);
    }
  }
  for (const Entry& entry : b)
    if (all && !entry_with_key(a, entry.key())) messages.push_back(what + " '" + entry.name + "' is only in " + in_b);
}

}  // namespace

std::vector<std::string> different_scenes_and_levels(const Manifest& a, const Manifest& b, bool all,
                                                     const std::string& in_a, const std::string& in_b) {
  std::vector<std::string> messages;
  compare_lists("scene", a.scenes, b.scenes, all, in_a, in_b, messages);
  compare_lists("noise level", a.noise_levels, b.noise_levels, all, in_a, in_b, messages);
  return messages;
}

std::vector<std::string> different_instances(const Manifest& a, const Manifest& b, const std::string& in_a,
                                             const std::string& in_b) {
  std::vector<std::string> messages = differing(a, b, {"seed", "commitment"}, in_a, in_b);
  for (std::string& message : different_scenes_and_levels(a, b, false, in_a, in_b))
    messages.push_back(std::move(message));
  return messages;
}

}  // namespace relign::records
