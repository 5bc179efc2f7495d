#include "records/damage.h"

#include <algorithm>

#include "base/error.h"

namespace relign::records {

std::string to_string(const Damage& damage) {
  return damage.file + (damage.line > 0 ? ":" + std::to_string(damage.line) : "") + ": " +
         (damage.trial.empty() ? "the line" : (damage.of_times ? "the times of trial " : "trial ") + damage.trial) +
         (damage.of_times && !damage.trial.empty() ? " are" : " is") + " damaged: " + damage.what;
}

void throw_if_damaged(const std::vector<Damage>& damaged) {
  if (damaged.empty()) return;
  constexpr std::size_t kNamed = 20;
  std::string text;
  for (std::size_t i = 0; i < std::min(damaged.size(), kNamed); ++i) text += to_string(damaged[i]) + "\n";
  if (damaged.size() > kNamed) text += "... and " + std::to_string(damaged.size() - kNamed) + " more\n";
  throw Error(ErrorKind::bad_input,
              text +
                  "restore the file from a copy, or run the suite again with --drop-damaged, which removes the "
                  "damaged lines and runs their trials again");
}

}  // namespace relign::records
