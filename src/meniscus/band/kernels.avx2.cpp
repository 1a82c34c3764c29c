#include <meniscus/band/kernel_bodies.h>

namespace meniscus::band {

const Kernels& avx2_kernels();
const Kernels& avx2_kernels() { return kSet; }

}  // namespace meniscus::band
