#pragma once

// Private to kernel_bodies.h: samples on their way into a halo and out of it.
#include <meniscus/band/float8.h>
#include <meniscus/band/kernels.h>

#include <cstring>

namespace {

using meniscus::band::halo_at;
using meniscus::band::Outline;
using meniscus::band::RowSource;

/// The rows of one column of bricks along k that a halo holds; kEnds: with what borders on their ends.
template <int dx, int dy, bool kEnds>
MENISCUS_KERNEL_INLINE void gather_column(const RowSource* source, float* halo) {
  const RowSource* column = source + (dx + 1) * 9 + (dy + 1) * 3;
  const RowSource behind = column[0], own = column[1], ahead = column[2];
  constexpr int i_begin = dx < 0 ? -2 : dx > 0 ? 8 : 0, i_end = dx < 0 ? 0 : dx > 0 ? 10 : 8;
  constexpr int j_begin = dy < 0 ? -2 : dy > 0 ? 8 : 0, j_end = dy < 0 ? 0 : dy > 0 ? 10 : 8;
  for (int i = i_begin; i < i_end; ++i)
#pragma GCC unroll 8
    for (int j = j_begin; j < j_end; ++j) {
      const auto row = static_cast<std::size_t>((i & 7) * 8 + (j & 7));
      const Float8 middle = load8(own.first + row * own.stride);
      float* to = halo + halo_at(i, j, 0);
      if (kEnds) {
        store8(to - 4, join8(load8(behind.first + row * behind.stride), middle));
        store8(to + 4, join8(middle, load8(ahead.first + row * ahead.stride)));
      } else {
        store8(to, middle);
      }
    }
}

template <int dx>
MENISCUS_KERNEL_INLINE void gather_columns(const RowSource* source, float* halo) {
  gather_column<dx, -1, true>(source, halo);
  gather_column<dx, 0, true>(source, halo);
  gather_column<dx, 1, true>(source, halo);
}

void gather_body(const RowSource* source, float* halo) {
  gather_columns<-1>(source, halo);
  gather_columns<0>(source, halo);
  gather_columns<1>(source, halo);
}

void gather_star_body(const RowSource* source, float* halo) {
  gather_column<-1, 0, false>(source, halo);
  gather_column<0, -1, false>(source, halo);
  gather_column<0, 0, true>(source, halo);
  gather_column<0, 1, false>(source, halo);
  gather_column<1, 0, false>(source, halo);
}

void centre_body(const float* halo, float* out) {
  for (int row = 0; row < 64; ++row) store8(out + 8 * row, load8(halo + halo_at(row >> 3, row & 7, 0)));
}

/// The rows' samples nearest to zero: of row n of eight in lane n.
MENISCUS_KERNEL_INLINE Float8 nearest_of(Float8 (&row)[8]) {
  for (Float8& r : row) r = abs8(r);
  for (int n = 0; n < 8; n += 2)
    row[n] = min8(__builtin_shufflevector(row[n], row[n + 1], 0, 8, 2, 10, 4, 12, 6, 14),
                  __builtin_shufflevector(row[n], row[n + 1], 1, 9, 3, 11, 5, 13, 7, 15));
  for (int n = 0; n < 8; n += 4)
    row[n] = min8(__builtin_shufflevector(row[n], row[n + 2], 0, 1, 8, 9, 4, 5, 12, 13),
                  __builtin_shufflevector(row[n], row[n + 2], 2, 3, 10, 11, 6, 7, 14, 15));
  return min8(__builtin_shufflevector(row[0], row[4], 0, 1, 2, 3, 8, 9, 10, 11),
              __builtin_shufflevector(row[0], row[4], 4, 5, 6, 7, 12, 13, 14, 15));
}

void outline_body(const float* samples, float voxel, Outline& out) {
  typedef std::uint8_t Bytes8 __attribute__((vector_size(8)));
  const Float8 zero = set8(0), scale = set8(Outline::kSteps / voxel), most = set8(Outline::kMost);
  for (std::size_t i = 0; i < 8; ++i) {
    Float8 row[8];
    std::uint64_t inside = 0;
#pragma GCC unroll 8
    for (std::size_t j = 0; j < 8; ++j) {
      row[j] = load8(samples + (i * 8 + j) * 8);
      inside |= static_cast<std::uint64_t>(bits8(row[j] < zero)) << (8 * j);
    }
    out.inside[i] = inside;
    const Bytes8 nearest = __builtin_convertvector(truncated8(min8(nearest_of(row) * scale, most)), Bytes8);
    std::memcpy(out.nearest.data() + 8 * i, &nearest, sizeof nearest);
  }
}

void nearer_body(const float* samples, float limit, meniscus::band::NodeBits& bits) {
  for (std::size_t i = 0; i < 8; ++i) {
    std::uint64_t plane = 0;
    for (std::size_t j = 0; j < 8; ++j)
      plane |= static_cast<std::uint64_t>(bits8(abs8(load8(samples + (i * 8 + j) * 8)) < set8(limit))) << (8 * j);
    bits[i] = plane;
  }
}

}  // namespace
