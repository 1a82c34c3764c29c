#include <meniscus/band/kernel_bodies.h>

namespace meniscus::band {

const Kernels& avx2_kernels();  // kernels.avx2.cpp

const Kernels& baseline_kernels() { return kSet; }

const Kernels& kernels() {
  static const Kernels& chosen = __builtin_cpu_supports("avx2") ? avx2_kernels() : baseline_kernels();
  return chosen;
}

}  // namespace meniscus::band
