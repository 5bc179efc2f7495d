// Imitation: a network that learnt from simulated misalignments where each lens's own optimum is.
#include "policies/policy_agent.hpp"

namespace {

using Imitation = relign::policies::PolicyAgent;

}  // namespace

RELIGN_PLUGIN(Imitation)
