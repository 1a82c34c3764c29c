#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus {
namespace {

RunControl with_threads(int n) { return RunControl({.threads = n, .seed = 0, .on_progress = {}}); }

TEST(Parallel, SumOfFloatsHasTheSameBitsForAnyThreadCount) {
  const auto sum = [](int threads) {
    return parallel_reduce(
        100'003, 64, with_threads(threads), 0.0,
        [](std::size_t begin, std::size_t end) {
          double s = 0;
          for (std::size_t i = begin; i < end; ++i) s += std::sin(static_cast<double>(i)) * 1e-3;
          return s;
        },
        [](double a, double b) { return a + b; });
  };
  const double one = sum(1);
  for (const int threads : {2, 3, 5, 8}) EXPECT_EQ(one, sum(threads));
}

TEST(Parallel, EveryIndexIsVisitedOnce) {
  std::vector<int> hits(1001, 0);
  parallel_for(hits.size(), 7, with_threads(3), [&](std::size_t i) { ++hits[i]; });
  for (const int h : hits) EXPECT_EQ(h, 1);
}

TEST(Parallel, CancelStopsTheLoop) {
  const RunControl run = with_threads(2);
  EXPECT_THROW(parallel_for(1'000'000, 1, run,
                            [&](std::size_t i) {
                              if (i == 10) run.cancel();
                            }),
               Cancelled);
}

TEST(RunControl, ProgressNeverGoesBackwards) {
  double last = -1;
  const RunControl run({.threads = {}, .seed = 0, .on_progress = [&](double f, std::string_view) {
                          EXPECT_GT(f, last);
                          last = f;
                        }});
  for (const double f : {0.1, 0.5, 0.3, 0.5, 0.9}) run.part(0, 0.5).progress(f);
  run.part(0.5, 1).progress(1);
  EXPECT_EQ(last, 1);
}

}  // namespace
}  // namespace meniscus
