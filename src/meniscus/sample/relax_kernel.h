#pragma once

// Included by relax.cpp and relax.avx2.cpp: the same operations in the same order on eight neighbours at a time, compiled
// for two instruction sets. Vectors of the compiler instead of a library: nothing here may be shared between the two.

#include <cstdint>
#include <cstring>

namespace meniscus::sample::relax_kernel {

/// A particle as its neighbours see it: where it is from the middle of the box, and its spacing, in some common unit.
/// Single precision: forces need no more, and the particles themselves are moved in double precision.
struct Neighbour {
  float x, y, z, spacing;
};

struct PairForce {
  float x, y, z;    ///< sum of −w' / (h r) · (x_i − x_j)
  float stiffness;  ///< sum of w'' / h²
};

/// Neighbours come in groups of eight; places that are free name a particle far from all others.
using PairKernel = PairForce (*)(const Neighbour* all, float half_reach, std::uint32_t i, const std::uint32_t* list,
                                 std::size_t count);

PairForce smooth_avx2(const Neighbour*, float, std::uint32_t, const std::uint32_t*, std::size_t);
PairForce contact_avx2(const Neighbour*, float, std::uint32_t, const std::uint32_t*, std::size_t);

namespace {

typedef float Four __attribute__((vector_size(16)));
typedef float Eight __attribute__((vector_size(32)));

inline Four loaded(const Neighbour& p) {
  Four v;
  std::memcpy(&v, &p, sizeof v);
  return v;
}

struct Group {
  Eight x, y, z, spacing;
};

/// Rows to columns: two transpositions of 4 × 4, side by side.
inline Group gathered(const Neighbour* all, const std::uint32_t* list) {
  const auto rows = [&](int k) {
    return __builtin_shufflevector(loaded(all[list[k]]), loaded(all[list[k + 4]]), 0, 1, 2, 3, 4, 5, 6, 7);
  };
  const Eight a = rows(0), b = rows(1), c = rows(2), d = rows(3);
  const Eight xy_ab = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
  const Eight xy_cd = __builtin_shufflevector(c, d, 0, 8, 1, 9, 4, 12, 5, 13);
  const Eight zs_ab = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
  const Eight zs_cd = __builtin_shufflevector(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
  return {__builtin_shufflevector(xy_ab, xy_cd, 0, 1, 8, 9, 4, 5, 12, 13),
          __builtin_shufflevector(xy_ab, xy_cd, 2, 3, 10, 11, 6, 7, 14, 15),
          __builtin_shufflevector(zs_ab, zs_cd, 0, 1, 8, 9, 4, 5, 12, 13),
          __builtin_shufflevector(zs_ab, zs_cd, 2, 3, 10, 11, 6, 7, 14, 15)};
}

inline Eight root(Eight v) {
  Eight r;
  for (int k = 0; k < 8; ++k) r[k] = __builtin_sqrtf(v[k]);
  return r;
}

/// Minus the first derivative and the second derivative of w at x = 1 − r/h.
struct Smooth {
  static Eight push(Eight x) { return 4 * x * x * x; }
  static Eight stiffness(Eight x, Eight) { return 12 * x * x; }
};
struct Contact {
  static Eight push(Eight x) { return 2 * x; }
  static Eight stiffness(Eight x, Eight zero) { return x > zero ? zero + 2 : zero; }
};

template <class Kernel>
inline PairForce pair_force(const Neighbour* all, float half_reach, std::uint32_t i, const std::uint32_t* list,
                            std::size_t count) {
  const Eight zero{0, 0, 0, 0, 0, 0, 0, 0}, tiny = zero + 1e-30F;
  const Neighbour p = all[i];
  Eight fx = zero, fy = zero, fz = zero, stiffness = zero;
  for (std::size_t k = 0; k < count; k += 8) {
    const Group q = gathered(all, list + k);
    const Eight dx = p.x - q.x, dy = p.y - q.y, dz = p.z - q.z;
    const Eight r2 = dx * dx + dy * dy + dz * dz, reach = half_reach * (p.spacing + q.spacing);
    const Eight r = root(r2 > tiny ? r2 : tiny), both = 1 / (r * reach), inverse = r * both;
    Eight x = 1 - r * inverse;
    x = x > zero ? x : zero;
    const Eight push = Kernel::push(x) * both;
    fx += push * dx;
    fy += push * dy;
    fz += push * dz;
    stiffness += Kernel::stiffness(x, zero) * inverse * inverse;
  }
  const auto sum = [](Eight v) { return ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7])); };
  return {sum(fx), sum(fy), sum(fz), sum(stiffness)};
}

}  // namespace
}  // namespace meniscus::sample::relax_kernel
