// ppo-paper: a policy trained from scratch by proximal policy optimisation with the paper's reward.
#include "policies/policy_agent.hpp"

namespace {

using PpoPaper = relign::policies::PolicyAgent;

}  // namespace

RELIGN_PLUGIN(PpoPaper)
