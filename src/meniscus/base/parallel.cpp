#include <meniscus/base/parallel.h>

#include <tbb/parallel_for.h>

#include <algorithm>

namespace meniscus {

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
  run.execute([&] { tbb::parallel_for(std::size_t{0}, blocks, one); });
}

}  // namespace meniscus
