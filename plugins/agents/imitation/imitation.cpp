// imitation: a policy trained by imitation learning to predict the displacement to each instance's own optimum.
#include "policies/policy_agent.hpp"

namespace {

using Imitation = relign::policies::PolicyAgent;

}  // namespace

RELIGN_PLUGIN(Imitation)
