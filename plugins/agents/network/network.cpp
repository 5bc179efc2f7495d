// network: an agent that follows an ONNX network from elsewhere, as its side file describes it.
#include <string>

#include "policies/policy_agent.hpp"

namespace {

// "my_net.json" -> "my_net.onnx"
std::string network_beside(const std::string& side_file) {
  const std::size_t dot = side_file.rfind('.'), slash = side_file.rfind('/');
  const bool has_ending = dot != std::string::npos && (slash == std::string::npos || dot > slash);
  return (has_ending ? side_file.substr(0, dot) : side_file) + ".onnx";
}

class ForeignNetwork final : public relign::policies::PolicyAgent {
 public:
  explicit ForeignNetwork(const relign::Parameters& given)
      : PolicyAgent(given, network_beside(given.text("side_file")), 0) {}
};

}  // namespace

RELIGN_PLUGIN(ForeignNetwork)
