// ppo-paper: a policy trained from scratch by proximal policy optimisation with the paper's reward.
#include "policies/policy_agent.hpp"

namespace {

class PpoPaper : public relign::policies::PolicyAgent {
 public:
  explicit PpoPaper(const relign::Parameters& given) : PolicyAgent(given, 0, given.integer("full_moves")) {}
};

}  // namespace

RELIGN_PLUGIN(PpoPaper)
