// imitation-ppo: the policy of imitation, fine-tuned by proximal policy optimisation.
#include "policies/policy_agent.hpp"

namespace {

using ImitationPpo = relign::policies::PolicyAgent;

}  // namespace

RELIGN_PLUGIN(ImitationPpo)
