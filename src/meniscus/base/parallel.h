#pragma once

#include <meniscus/base/function_ref.h>
#include <meniscus/base/run_control.h>

#include <cstddef>
#include <vector>

namespace meniscus {

/// Calls work(begin, end) for consecutive blocks of [0, count), `block` indices each (the last may be shorter), in parallel.
/// The cut into blocks depends on `count` and `block` alone, so work that writes only its own slots gives the same bits for
/// any number of threads. Looks for cancellation before every block; throws Cancelled, or what `work` throws.
void parallel_blocks(std::size_t count, std::size_t block, const RunControl& run,
                     FunctionRef<void(std::size_t begin, std::size_t end)> work);

/// Calls body(i) for every i in [0, count), in parallel, in blocks of `block`.
template <class Body>
void parallel_for(std::size_t count, std::size_t block, const RunControl& run, const Body& body) {
  parallel_blocks(count, block, run, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

/// Combines map(begin, end) of every block in block order: deterministic for any number of threads, floating point included.
template <class T, class Map, class Combine>
T parallel_reduce(std::size_t count, std::size_t block, const RunControl& run, T initial, const Map& map,
                  const Combine& combine) {
  if (block == 0) block = 1;
  std::vector<T> partial((count + block - 1) / block, initial);
  parallel_blocks(count, block, run, [&](std::size_t begin, std::size_t end) { partial[begin / block] = map(begin, end); });
  T total = std::move(initial);
  for (auto& p : partial) total = combine(std::move(total), std::move(p));
  return total;
}

}  // namespace meniscus
