// One algorithm's place in a trial: the conversation it holds, as the services beside it see it. The trial's own
// algorithm has one (conversation.h), and each algorithm that it runs another (nested.h).
#pragma once

#include <relign/plugin.h>

#include "plugin_host/catalog.h"

namespace relign::trials {

class Seat {
 public:
  virtual ~Seat() = default;
  // The host's own table, unguarded.
  virtual const relign_conversation& table() const = 0;
  virtual const plugin_host::Choice& algorithm() const = 0;
  virtual unsigned steps_left() const = 0;
  // The last step as this algorithm sees it; struct_size of `seen` says how much it has room for.
  virtual void tell(relign_observation* seen) const = 0;
};

}  // namespace relign::trials
