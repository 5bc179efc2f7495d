// The agent behind imitation, imitation_ppo and ppo_paper in plugins/agents: it follows a trained policy network.
#pragma once

#include <cstdint>
#include <relign/plugin.hpp>

#include "model.hpp"

namespace relign::policies {

// Parameters: "model" (file), "whole_guesses" (integer), "other_scenes" (boolean).
//
// Residual output (the displacement to the optimum, "way" in the side file): the first `whole_guesses` moves follow the
// output in full, which distant starts need; later moves are scaled by 1/2, 1/3, ... (residual gain schedule). The pose
// then is the mean of the later predictions, so its noise falls with the square root of their number. The
// recommendation is the current pose plus the scaled output.
//
// Residual output with doubt ("doubt" in the side file): every move is to the optimum expected from all answers so far
// (belief.hpp), which is also the recommendation. With `stop_below`, the agent stops when another image is expected to
// reduce the excess RMSE by less than that.
//
// Relative output (the next move, "move" in the side file): every move follows the output in full. The moves do not
// shrink near the optimum, so the recommendation is the pose whose capture had the lowest RMSE to the reference image.
// With `full_moves`, only so many follow it in full, and move k is scaled by full_moves / k after them.
// With a history ("history" in the observation): first the side file's probes, then every move follows the output in
// full, limited to the side file's largest move. The network itself weighs what it remembers. The recommendation is the
// visited pose with the lowest score where a reading measures it; else the current pose, plus the output if that is a
// displacement.
class PolicyAgent : public Agent {
 public:
  // stop_below: in the scene's units; 0: never. full_moves: 0: all.
  explicit PolicyAgent(const Parameters& given, double stop_below = 0, std::int64_t full_moves = 0);
  // With the network at this path instead of that of "model".
  PolicyAgent(const Parameters& given, const std::string& onnx_path, double stop_below, std::int64_t full_moves = 0);
  void run(Trial& trial) override;

 private:
  void check_scene(const Trial& trial) const;
  void check_readings(const Trial& trial, const std::string& another) const;
  void push_frame(const ImageView& image);
  void follow_displacements(Trial& trial);
  void follow_belief(Trial& trial, const Doubt& doubt);
  void follow_moves(Trial& trial);
  void follow_history(Trial& trial);

  Model model_;
  std::int64_t whole_guesses_;
  bool other_scenes_;
  double stop_below_;
  std::int64_t full_moves_;
  std::vector<float> frames_;  // frames x rows x size, zeros before the first capture
};

// The factor on the network's output at step 1, 2, ...
double gain(unsigned step, std::int64_t whole_guesses);

}  // namespace relign::policies
