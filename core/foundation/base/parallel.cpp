#include "base/parallel.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace relign {

namespace {

// How long an idle thread spins before it sleeps. Frames and their parts follow each other within microseconds, and
// waking a thread takes longer than some of them. It yields, so that other threads with work get the core.
constexpr std::chrono::microseconds kSpinTime{100};

template <class Condition>
void await(const Condition& condition) {
  const auto sleep_at = std::chrono::steady_clock::now() + kSpinTime;
  while (!condition() && std::chrono::steady_clock::now() < sleep_at) std::this_thread::yield();
}

}  // namespace

struct Parallel::Shared {
  std::mutex mutex;
  std::condition_variable wake, done;
  const void* body = nullptr;
  Call call = nullptr;
  int count = 0;
  std::atomic<int> next{0};
  std::atomic<unsigned> busy{0};
  std::atomic<unsigned> round{0};
  std::atomic<bool> leave{false};
  std::exception_ptr failure;
  std::vector<std::thread> helpers;

  void work(unsigned thread) {
    try {
      for (int item = next.fetch_add(1); item < count; item = next.fetch_add(1)) call(body, item, thread);
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!failure) failure = std::current_exception();
      next.store(count);
    }
  }
  void help(unsigned thread) {
    unsigned seen = 0;
    const auto called = [&] { return leave || round != seen; };
    while (true) {
      await(called);
      {
        std::unique_lock<std::mutex> lock(mutex);
        wake.wait(lock, called);
        if (leave) return;
        seen = round;
      }
      work(thread);
      if (busy.fetch_sub(1) > 1) continue;
      const std::lock_guard<std::mutex> lock(mutex);  // the caller is either spinning or waiting by now
      done.notify_one();
    }
  }
};

Parallel::Parallel(unsigned threads) : threads_(threads > 0 ? threads : 1), shared_(std::make_unique<Shared>()) {
  for (unsigned thread = 1; thread < threads_; ++thread)
    shared_->helpers.emplace_back([this, thread] { shared_->help(thread); });
}

Parallel::~Parallel() {
  {
    const std::lock_guard<std::mutex> lock(shared_->mutex);
    shared_->leave = true;
  }
  shared_->wake.notify_all();
  for (std::thread& helper : shared_->helpers) helper.join();
}

void Parallel::run(int count, const void* body, Call call) {
  if (threads_ == 1) {
    for (int item = 0; item < count; ++item) call(body, item, 0);
    return;
  }
  Shared& shared = *shared_;
  {
    const std::lock_guard<std::mutex> lock(shared.mutex);
    shared.body = body;
    shared.call = call;
    shared.count = count;
    shared.next.store(0);
    shared.busy = threads_ - 1;
    shared.failure = nullptr;
    ++shared.round;
  }
  shared.wake.notify_all();
  shared.work(0);
  const auto all_done = [&shared] { return shared.busy == 0; };
  await(all_done);
  std::unique_lock<std::mutex> lock(shared.mutex);
  shared.done.wait(lock, all_done);
  if (shared.failure) std::rethrow_exception(shared.failure);
}

}  // namespace relign
