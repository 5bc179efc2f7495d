// A network that proximal policy optimisation trained from nothing, by the paper's reward.
#include "policies/policy_agent.hpp"

namespace {

using PpoPaper = relign::policies::PolicyAgent;

}  // namespace

RELIGN_PLUGIN(PpoPaper)
