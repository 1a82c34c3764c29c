#pragma once

// Included by repulsion.cpp, repulsion.avx2.cpp and repulsion.avx512.cpp: the same operations in the same order on eight
// neighbours at a time, in as many packets as the instruction set needs for them.

#include <meniscus/field/exponential.h>
#include <meniscus/field/packet.h>

#include <cstdint>
#include <utility>

namespace meniscus::sample::repulsion_kernel {

struct Input {
  const double *x, *y, *z, *nx, *ny, *nz, *sigma;
  double alpha, reach2;  ///< reach2: squared, in radii
};

struct Sums {
  double px, py, pz, energy, moment;  ///< moment: Σ r² E_ij
};

using Kernel = Sums (*)(const Input&, std::uint32_t i, const std::uint32_t* list, std::uint32_t count);

Sums sums_avx2(const Input&, std::uint32_t i, const std::uint32_t* list, std::uint32_t count);
Sums sums_avx512(const Input&, std::uint32_t i, const std::uint32_t* list, std::uint32_t count);

constexpr std::uint32_t kLanes = 8;

template <class T, std::size_t... L>
T gathered(const double* values, const std::uint32_t* list, std::index_sequence<L...>) {
  return typename T::register_type{values[list[L]]...};
}

template <class T>
T gathered(const double* values, const std::uint32_t* list) {
  return gathered<T>(values, list, std::make_index_sequence<T::size>());
}

/// What a packet of neighbours does to particle i.
template <class T>
struct Packet {
  T px = T(0.0), py = T(0.0), pz = T(0.0), energy = T(0.0), moment = T(0.0);

  /// The neighbours of `group` where `counts` holds.
  template <class M>
  void add(const Input& in, std::uint32_t i, const std::uint32_t* group, const M& counts) {
    const T dx = T(in.x[i]) - gathered<T>(in.x, group), dy = T(in.y[i]) - gathered<T>(in.y, group),
            dz = T(in.z[i]) - gathered<T>(in.z, group);
    const T r2 = dx * dx + dy * dy + dz * dz;
    const double si2 = in.sigma[i] * in.sigma[i];
    const T sj = gathered<T>(in.sigma, group), sj2 = sj * sj, inverse = T(1.0) / sj2;
    // same_sheet()
    const T cosine = T(in.nx[i]) * gathered<T>(in.nx, group) + T(in.ny[i]) * gathered<T>(in.ny, group) +
                     T(in.nz[i]) * gathered<T>(in.nz, group);
    const T sheet = xsimd::min(xsimd::max(T(1.0) + T(2.0) * cosine, T(0.0)), T(1.0));
    const auto felt = counts && r2 < T(in.reach2) * xsimd::max(sj2, T(si2));
    const T weight = xsimd::select(felt, T(in.alpha) * sheet, T(0.0));
    const auto decay = [&](const T& rate) { return field::packet::exponential(xsimd::max(r2 * rate, T(-700.0))); };
    const T own = weight * decay(T(-0.5 / si2));
    const T push = own + T(si2) * inverse * weight * decay(T(-0.5) * inverse);
    px += push * dx;
    py += push * dy;
    pz += push * dz;
    energy += own;
    moment += r2 * own;
  }
};

/// Adds up eight lanes in one order, whatever the packets.
template <class T>
double total(const Packet<T>* packets, T Packet<T>::*number) {
  alignas(64) double v[kLanes];
  for (std::size_t k = 0; k < kLanes; k += T::size) (packets[k / T::size].*number).store_aligned(v + k);
  return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

template <class T>
Sums sums(const Input& in, std::uint32_t i, const std::uint32_t* list, std::uint32_t count) {
  alignas(64) static constexpr double kLane[kLanes] = {0, 1, 2, 3, 4, 5, 6, 7};
  Packet<T> packets[kLanes / T::size];
  for (std::uint32_t k = 0; k < count; k += kLanes) {
    // A short last group repeats the first neighbour in the free lanes, which do not count.
    std::uint32_t filled[kLanes];
    const bool short_group = count - k < kLanes;
    if (short_group)
      for (std::uint32_t l = 0; l < kLanes; ++l) filled[l] = list[k + l < count ? k + l : k];
    const std::uint32_t* group = short_group ? filled : list + k;
    const T used(static_cast<double>(count - k));
    for (std::size_t l = 0; l < kLanes; l += T::size)
      packets[l / T::size].add(in, i, group + l, T::load_aligned(kLane + l) < used);
  }
  return {total(packets, &Packet<T>::px), total(packets, &Packet<T>::py), total(packets, &Packet<T>::pz),
          total(packets, &Packet<T>::energy), total(packets, &Packet<T>::moment)};
}

}  // namespace meniscus::sample::repulsion_kernel
