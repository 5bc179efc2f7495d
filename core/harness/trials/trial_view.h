// One algorithm's view of a trial, as its services see it. The trial's own algorithm has one (trial_host.h), and so has
// each algorithm that it runs (nested.h).
#pragma once

#include <relign/plugin.h>

#include "plugin_host/catalog.h"

namespace relign::trials {

class TrialView {
 public:
  virtual ~TrialView() = default;
  // The host's own table, unguarded.
  virtual const relign_trial& table() const = 0;
  virtual const plugin_host::Choice& algorithm() const = 0;
  virtual unsigned steps_left() const = 0;
  // Writes the last step as this algorithm may observe it, up to struct_size of `observation`.
  virtual void write_observation(relign_observation* observation) const = 0;
};

}  // namespace relign::trials
