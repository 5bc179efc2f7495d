// A thread pool for one parallel loop at a time. Results do not depend on which thread runs which item,
// because a body writes only to data of its own item.
#pragma once

#include <memory>

namespace relign {

class Parallel {
 public:
  explicit Parallel(unsigned threads);  // 1: everything runs in the calling thread
  ~Parallel();
  Parallel(const Parallel&) = delete;
  Parallel& operator=(const Parallel&) = delete;

  unsigned threads() const { return threads_; }
  // Calls body(item, thread) for each item in 0..count-1, with thread in 0..threads()-1, and returns when all are
  // done. The first exception of a body is rethrown here after all threads have stopped. Not re-entrant. Does not
  // allocate.
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
