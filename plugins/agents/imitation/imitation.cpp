// imitation: a policy trained by imitation learning to predict the displacement to each instance's own optimum.
#include "policies/policy_agent.hpp"

namespace {

class Imitation final : public relign::policies::PolicyAgent {
 public:
  explicit Imitation(const relign::Parameters& given) : PolicyAgent(given, given.number("stop_below")) {}
};

}  // namespace

RELIGN_PLUGIN(Imitation)
