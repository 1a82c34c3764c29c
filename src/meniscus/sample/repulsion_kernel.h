#pragma once

// Included by repulsion.cpp and repulsion.avx2.cpp: the same operations in the same order, compiled for two instruction
// sets. Nothing here may be shared between the two.

#include <cstdint>

namespace meniscus::sample::repulsion_kernel {

struct Input {
  const double *x, *y, *z, *nx, *ny, *nz, *sigma;
  double alpha, reach2;  ///< reach2: squared, in radii
};

struct Sums {
  double px, py, pz, energy, moment;  ///< moment: Σ r² E_ij
};

Sums sums_avx2(const Input&, std::uint32_t i, const std::uint32_t* list, std::uint32_t count);

namespace {

typedef double Four __attribute__((vector_size(32)));
typedef std::int64_t FourBits __attribute__((vector_size(32)));

inline Four gathered(const double* values, const std::uint32_t* list) {
  return Four{values[list[0]], values[list[1]], values[list[2]], values[list[3]]};
}

/// exp of numbers <= 0 to about 1e-13; anything below −700 counts as −700.
inline Four exponential(Four x) {
  const Four zero{0, 0, 0, 0}, lowest = zero - 700.0, shift = zero + 6755399441055744.0;  // 1.5 · 2^52: rounds to an integer
  x = x > lowest ? x : lowest;
  const Four shifted = x * 1.4426950408889634 + shift;
  const Four n = shifted - shift;
  const Four r = (x - n * 0.6931471803691238) - n * 1.9082149292705877e-10;
  Four p = zero + 1.0 / 39916800;
  p = p * r + 1.0 / 3628800;
  p = p * r + 1.0 / 362880;
  p = p * r + 1.0 / 40320;
  p = p * r + 1.0 / 5040;
  p = p * r + 1.0 / 720;
  p = p * r + 1.0 / 120;
  p = p * r + 1.0 / 24;
  p = p * r + 1.0 / 6;
  p = p * r + 0.5;
  p = p * r + 1.0;
  p = p * r + 1.0;
  // The low bits of `shifted` hold n: into the exponent with them.
  return (Four)((FourBits)p + ((FourBits)shifted << 52));
}

inline Sums sums(const Input& in, std::uint32_t i, const std::uint32_t* list, std::uint32_t count) {
  const Four zero{0, 0, 0, 0}, one = zero + 1.0, lane{0, 1, 2, 3};
  const double si2 = in.sigma[i] * in.sigma[i];
  Four px = zero, py = zero, pz = zero, energy = zero, moment = zero;
  for (std::uint32_t k = 0; k < count; k += 4) {
    // A short last group repeats its first member in the free lanes, where the weight is then set to 0.
    std::uint32_t group[4];
    for (std::uint32_t l = 0; l < 4; ++l) group[l] = list[k + l < count ? k + l : k];
    const Four dx = in.x[i] - gathered(in.x, group), dy = in.y[i] - gathered(in.y, group),
               dz = in.z[i] - gathered(in.z, group);
    const Four r2 = dx * dx + dy * dy + dz * dz;
    const Four sj = gathered(in.sigma, group), sj2 = sj * sj;
    // same_sheet()
    Four weight =
        1 + 2 * (in.nx[i] * gathered(in.nx, group) + in.ny[i] * gathered(in.ny, group) + in.nz[i] * gathered(in.nz, group));
    weight = weight > zero ? weight : zero;
    weight = in.alpha * (weight < one ? weight : one);
    const Four larger = sj2 > zero + si2 ? sj2 : zero + si2;
    weight = r2 < in.reach2 * larger ? weight : zero;
    weight = lane < zero + static_cast<double>(count - k) ? weight : zero;
    const Four own = weight * exponential(-0.5 * r2 / si2);
    const Four push = own + si2 / sj2 * weight * exponential(-0.5 * r2 / sj2);
    px += push * dx;
    py += push * dy;
    pz += push * dz;
    energy += own;
    moment += r2 * own;
  }
  const auto sum = [](Four v) { return (v[0] + v[1]) + (v[2] + v[3]); };
  return {sum(px), sum(py), sum(pz), sum(energy), sum(moment)};
}

}  // namespace
}  // namespace meniscus::sample::repulsion_kernel
