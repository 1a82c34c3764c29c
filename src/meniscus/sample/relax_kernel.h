#pragma once

// Included by relax.cpp and relax.avx2.cpp: the same operations in the same order on four neighbours at a time, compiled for
// two instruction sets. Vectors of the compiler instead of a library: nothing here may be shared between the two.

#include <cstdint>

namespace meniscus::sample::relax_kernel {

struct PairForce {
  double x, y, z;    ///< sum of −w' / (h r) · (x_i − x_j)
  double stiffness;  ///< sum of w'' / h²
};

struct PairInput {
  const double *x, *y, *z, *spacing;
  double half_reach;  ///< h of a pair = half_reach · (spacing_i + spacing_j)
};

using PairKernel = PairForce (*)(const PairInput&, std::uint32_t i, const std::uint32_t* list, std::uint32_t count);

PairForce smooth_avx2(const PairInput&, std::uint32_t, const std::uint32_t*, std::uint32_t);
PairForce contact_avx2(const PairInput&, std::uint32_t, const std::uint32_t*, std::uint32_t);

namespace {

typedef double Four __attribute__((vector_size(32)));

inline Four gathered(const double* values, const std::uint32_t* list) {
  return Four{values[list[0]], values[list[1]], values[list[2]], values[list[3]]};
}

inline Four root(Four v) {
  return Four{__builtin_sqrt(v[0]), __builtin_sqrt(v[1]), __builtin_sqrt(v[2]), __builtin_sqrt(v[3])};
}

/// Minus the first derivative and the second derivative of w at x = 1 − r/h.
struct Smooth {
  static Four push(Four x) { return 4 * x * x * x; }
  static Four stiffness(Four x, Four) { return 12 * x * x; }
};
struct Contact {
  static Four push(Four x) { return 2 * x; }
  static Four stiffness(Four x, Four zero) { return x > zero ? zero + 2 : zero; }
};

template <class Kernel>
inline PairForce pair_force(const PairInput& in, std::uint32_t i, const std::uint32_t* list, std::uint32_t count) {
  const Four zero{0, 0, 0, 0}, tiny = zero + 1e-300, lane{0, 1, 2, 3};
  Four fx = zero, fy = zero, fz = zero, stiffness = zero;
  for (std::uint32_t k = 0; k < count; k += 4) {
    // A short last group repeats its first member in the free lanes, where x is then set to 0.
    std::uint32_t group[4];
    for (std::uint32_t l = 0; l < 4; ++l) group[l] = list[k + l < count ? k + l : k];
    const Four dx = in.x[i] - gathered(in.x, group), dy = in.y[i] - gathered(in.y, group),
               dz = in.z[i] - gathered(in.z, group);
    const Four inverse = 1 / (in.half_reach * (in.spacing[i] + gathered(in.spacing, group)));
    const Four r2 = dx * dx + dy * dy + dz * dz;
    const Four r = root(r2 > tiny ? r2 : tiny);
    Four x = 1 - r * inverse;
    x = x > zero ? x : zero;
    x = lane < zero + static_cast<double>(count - k) ? x : zero;
    const Four push = Kernel::push(x) * inverse / r;
    fx += push * dx;
    fy += push * dy;
    fz += push * dz;
    stiffness += Kernel::stiffness(x, zero) * inverse * inverse;
  }
  const auto sum = [](Four v) { return (v[0] + v[1]) + (v[2] + v[3]); };
  return {sum(fx), sum(fy), sum(fz), sum(stiffness)};
}

}  // namespace
}  // namespace meniscus::sample::relax_kernel
