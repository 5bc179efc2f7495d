// PPO: a network that reinforcement learning has trained, from scratch as the paper's or on what imitation learnt.
#include "policies/policy_agent.hpp"

namespace {

using Ppo = relign::policies::PolicyAgent;

}  // namespace

RELIGN_PLUGIN(Ppo)
