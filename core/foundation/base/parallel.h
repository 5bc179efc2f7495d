// A few threads that share the items of one loop at a time. Which thread does which item never
// matters: bodies write to places of their own item only.
#pragma once

#include <memory>

namespace relign {

class Parallel {
 public:
  explicit Parallel(unsigned threads);  // 1: everything runs in the caller
  ~Parallel();
  Parallel(const Parallel&) = delete;
  Parallel& operator=(const Parallel&) = delete;

  unsigned threads() const { return threads_; }
  // body(item, thread) for item 0..count-1, thread 0..threads()-1; returns when all are done. The first
  // exception of a body is thrown here after all threads have stopped. Not re-entrant.
  // Allocates nothing.
  template <class Body>
  void for_each(int count, const Body& body) {
    run(count, &body, [](const void* of, int item, unsigned thread) { (*static_cast<const Body*>(of))(item, thread); });
  }

 private:
  using Call = void (*)(const void* body, int item, unsigned thread);
  void run(int count, const void* body, Call call);
  struct Shared;
  unsigned threads_;
  std::unique_ptr<Shared> shared_;
};

}  // namespace relign
