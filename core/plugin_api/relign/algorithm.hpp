// relign/algorithm.hpp: the classes that optimizers and agents derive from. Comes with relign/plugin.hpp.
#ifndef RELIGN_ALGORITHM_HPP
#define RELIGN_ALGORITHM_HPP

#include <optional>
#include <relign/trial.hpp>

namespace relign {

// An algorithm drives its trial: it returns when the trial gives no more steps, or earlier
// to declare itself finished. One object runs one trial.
class Algorithm {
 public:
  virtual ~Algorithm() = default;
  virtual void run(Trial& trial) = 0;
};

// Searches. Without a recommendation of its own, the best measured pose counts.
class Optimizer : public Algorithm {};

// Has learnt, or owns a model. Without a recommendation of its own, the current pose counts.
class Agent : public Algorithm {};

// For authors who prefer to be asked: implement ask and tell instead of run.
template <class Base = Optimizer>
class AskTell : public Base {
 public:
  virtual void begin(Trial& /*trial*/) {}
  virtual Pose ask() = 0;                          // the next commanded pose
  virtual void tell(const Observation& seen) = 0;  // step 0 included
  virtual std::optional<Pose> recommendation() { return std::nullopt; }
  virtual bool finished() const { return false; }

  void run(Trial& trial) final {
    begin(trial);
    std::optional<Observation> seen = trial.first();
    while (seen) {
      tell(*seen);
      if (const auto pose = recommendation()) trial.recommend(*pose);
      if (finished()) return;
      seen = trial.step(ask());
    }
  }
};

}  // namespace relign

#endif  // RELIGN_ALGORITHM_HPP
