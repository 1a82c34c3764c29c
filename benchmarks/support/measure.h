#pragma once

#include <chrono>
#include <ctime>

namespace meniscus::bench {

/// How long some work took: by the clock, and the processor time of all threads (which a busy machine does not stretch).
struct Measure {
  double seconds = 0;
  double cpu_seconds = 0;
};

template <class Work>
Measure measure(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  work();
  const double cpu_taken = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), cpu_taken};
}

/// Repeats `work` until it has taken `least` seconds of processor time; returns the measure of one go.
template <class Work>
Measure measure_repeated(const Work& work, double least = 0.1) {
  work();
  Measure total;
  int times = 0;
  for (int batch = 1; total.cpu_seconds < least; batch *= 2) {
    const Measure m = measure([&] {
      for (int i = 0; i < batch; ++i) work();
    });
    total.seconds += m.seconds;
    total.cpu_seconds += m.cpu_seconds;
    times += batch;
  }
  return {total.seconds / times, total.cpu_seconds / times};
}

}  // namespace meniscus::bench
