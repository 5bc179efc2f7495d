// Changes inputs as readers dread it: flipped bits, cut ends, spliced files, numbers at their limits, nesting. The same
// seed gives the same changes everywhere.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace relign::fuzz {

class Mutator {
 public:
  // `corpus` is borrowed and not empty; `words` are what the kind of input is made of. No result is longer than
  // `most_bytes`, unless the corpus has such.
  Mutator(std::uint64_t seed, const std::vector<std::string>& corpus, std::vector<std::string> words,
          std::size_t most_bytes);
  std::string next();

 private:
  std::size_t below(std::size_t count) { return count == 0 ? 0 : static_cast<std::size_t>(random_() % count); }
  void change(std::string& bytes);
  void change_number(std::string& bytes);

  std::mt19937_64 random_;
  const std::vector<std::string>& corpus_;
  std::vector<std::string> words_;
  std::size_t most_bytes_;
};

// Quoted texts and words of the corpus, shortest first and each once: most of what its kind of input is made of.
std::vector<std::string> words_of(const std::vector<std::string>& corpus);

}  // namespace relign::fuzz
