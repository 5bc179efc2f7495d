// An agent that follows a trained network: what imitation, imitation_ppo and ppo_paper in plugins/agents are made of.
#pragma once

#include <cstdint>
#include <relign/plugin.hpp>

#include "model.hpp"

namespace relign::policies {

// Parameters: "model" (file), "whole_guesses" (integer), "other_scenes" (boolean).
//
// A network that says the way to the optimum is followed whole for the first steps, which a far start needs, then by a
// share of 1/2, 1/3, ...: the pose becomes the mean of all later guesses and their noise falls as one over the root of
// their number, and the recommendation is where it leads. A network that says the next move is followed as it is; its
// moves never become smaller, so that it walks around the optimum: the recommendation is where the capture was nearest
// to the reference image.
class PolicyAgent : public Agent {
 public:
  explicit PolicyAgent(const Parameters& given);
  void run(Conversation& talk) override;

 private:
  void check_scene(const Conversation& talk) const;
  void look(const ImageView& image);
  void follow_guesses(Conversation& talk);
  void follow_moves(Conversation& talk);

  Model model_;
  std::int64_t whole_guesses_;
  bool other_scenes_;
  std::vector<float> frames_;  // frames x size x size, zeros before the start
};

// Share of the guess at step 1, 2, ... that is moved.
double gain(unsigned step, std::int64_t whole_guesses);

}  // namespace relign::policies
