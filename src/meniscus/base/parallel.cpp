#include <meniscus/base/parallel.h>

#include <algorithm>

#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#else
#include <tbb/parallel_for.h>
#endif

namespace meniscus {
namespace {

/// Calls one(b) for every block, in parallel. The sanitizer does not see how TBB orders things, so it gets plain threads.
#ifdef __SANITIZE_THREAD__
template <class One>
void for_blocks(std::size_t blocks, const RunControl& run, const One& one) {
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr thrown;
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < std::max(2, run.threads()); ++t)
      threads.emplace_back([&] {
        try {
          for (std::size_t b = next++; b < blocks; b = next++) one(b);
        } catch (...) {
          next = blocks;
          const std::lock_guard lock(mutex);
          thrown = std::current_exception();
        }
      });
  }
  if (thrown) std::rethrow_exception(thrown);
}
#else
template <class One>
void for_blocks(std::size_t blocks, const RunControl& run, const One& one) {
  run.execute([&] { tbb::parallel_for(std::size_t{0}, blocks, one); });
}
#endif

}  // namespace

void parallel_blocks(std::size_t count, std::size_t block, const RunControl& run,
                     FunctionRef<void(std::size_t, std::size_t)> work) {
  run.check();
  if (count == 0) return;
  block = std::max<std::size_t>(block, 1);
  const std::size_t blocks = (count + block - 1) / block;
  const auto one = [&](std::size_t b) {
    run.check();
    work(b * block, std::min(count, (b + 1) * block));
  };
  // A single block, or a single thread, needs no scheduler.
  if (blocks == 1 || run.threads() == 1) {
    for (std::size_t b = 0; b < blocks; ++b) one(b);
    return;
  }
  for_blocks(blocks, run, one);
}

}  // namespace meniscus
