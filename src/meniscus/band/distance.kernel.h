#pragma once

// Private to kernel_bodies.h: what spreads from the nodes next to the surface.
#include <meniscus/band/float8.h>
#include <meniscus/band/kernels.h>

namespace {

using meniscus::band::halo_at;
using meniscus::band::kHaloX;
using meniscus::band::kHaloY;
using meniscus::band::RowLayers;
using meniscus::band::Rows;

/// Where a node has a neighbour on the other side of the surface.
MENISCUS_KERNEL_INLINE Int8 beside_surface(const float* p) {
  const Float8 zero = set8(0);
  const Int8 inside = load8(p) < zero;
  return (inside ^ (load8(p - kHaloX) < zero)) | (inside ^ (load8(p + kHaloX) < zero)) |
         (inside ^ (load8(p - kHaloY) < zero)) | (inside ^ (load8(p + kHaloY) < zero)) | (inside ^ (load8(p - 1) < zero)) |
         (inside ^ (load8(p + 1) < zero));
}

/// The rows of a brick numbered along diagonals: number 8 d + i is row j = d + i (mod 8) of plane i. Going through them so,
/// no row waits for the one before it.
MENISCUS_KERNEL_INLINE Rows along_diagonals(Rows rows) {
  const auto turn = [&rows](int by, Rows planes, Rows stay) {  // j - by for j in these planes
    rows = (rows & ~planes) | (((rows >> by & stay) | (rows << (8 - by) & ~stay)) & planes);
  };
  turn(1, 0xFF00FF00FF00FF00, 0x7F7F7F7F7F7F7F7F);
  turn(2, 0xFFFF0000FFFF0000, 0x3F3F3F3F3F3F3F3F);
  turn(4, 0xFFFFFFFF00000000, 0x0F0F0F0F0F0F0F0F);
  const auto transpose = [&rows](int by, Rows mask) {
    const Rows t = (rows ^ rows >> by) & mask;
    rows ^= t ^ t << by;
  };
  transpose(7, 0x00AA00AA00AA00AA);
  transpose(14, 0x0000CCCC0000CCCC);
  transpose(28, 0x00000000F0F0F0F0);
  return rows;
}

/// Calls work(row) for every row, layer by layer.
template <class Work>
MENISCUS_KERNEL_INLINE void for_rows_outwards(const RowLayers& rows, const Work& work) {
  for (const Rows layer : rows)
    for (Rows left = along_diagonals(layer); left != 0; left &= left - 1) {
      const int n = __builtin_ctzll(left);
      work((n & 7) * 8 + (((n >> 3) + n) & 7));
    }
}

/// Weighted speeds of the neighbours nearer to the surface.
struct Arrived {
  Float8 sum, weight;
};
MENISCUS_KERNEL_INLINE Arrived upwind_speed(Float8 here, Float8 phi_m, Float8 phi_p, Float8 v_m, Float8 v_p) {
  const Float8 m = abs8(phi_m), p = abs8(phi_p), zero = set8(0);
  const Float8 v = m < p ? v_m : v_p;
  const Float8 w = max8(here - min8(m, p), zero);
  return {v == v ? w * v : zero, v == v ? w : zero};
}

void extend_body(const float* phi_halo, float* speed_halo, const RowLayers& rows) {
  const Float8 zero = set8(0), one = set8(1);
  constexpr int kAlongRow = 2;  // steps along the row per visit
  for_rows_outwards(
      rows, [&](int row) __attribute__((always_inline)) {
        const float* f = phi_halo + halo_at(row >> 3, row & 7, 0);
        float* v = speed_halo + halo_at(row >> 3, row & 7, 0);
        const Float8 here = abs8(load8(f));
        const Float8 own = load8(v), behind = load8(v - 8), ahead = load8(v + 8);
        const Int8 beside = beside_surface(f);
        const Arrived x = upwind_speed(here, load8(f - kHaloX), load8(f + kHaloX), load8(v - kHaloX), load8(v + kHaloX));
        const Arrived y = upwind_speed(here, load8(f - kHaloY), load8(f + kHaloY), load8(v - kHaloY), load8(v + kHaloY));
        const Float8 phi_m = load8(f - 1), phi_p = load8(f + 1);
        Float8 r = own;
        for (int t = 0; t < kAlongRow; ++t) {
          const Arrived z = upwind_speed(here, phi_m, phi_p, before8(behind, r), after8(r, ahead));
          const Float8 weight = x.weight + y.weight + z.weight;
          const Float8 mean = (x.sum + y.sum + z.sum) / (weight > zero ? weight : one);
          r = beside ? own : weight > zero ? mean : r;
        }
        store8(v, r);
      });
}

/// One axis of the eikonal stencil: (u - a)² w = 1, in voxels.
struct Upwind {
  Float8 a, w;
};
/// The nearer to the surface of both neighbours along an axis.
struct Nearer {
  Float8 value;
  Int8 behind;

  MENISCUS_KERNEL_MEMBER Nearer(const float* row, int stride, Float8 sign) {
    const Float8 m = sign * load8(row - stride), p = sign * load8(row + stride);
    value = min8(m, p);
    behind = m < p;
  }
  MENISCUS_KERNEL_MEMBER Upwind upwind(const float* row, int stride, Float8 sign) const {
    const Float8 far = sign * (behind ? load8(row - 2 * stride) : load8(row + 2 * stride));
    const Int8 second = far < value;
    return {second ? value + (value - far) * set8(1.0f / 3.0f) : value, second ? set8(2.25f) : set8(1)};
  }
};
MENISCUS_KERNEL_INLINE void order(Upwind& l, Upwind& r) {
  const auto swap = r.a < l.a;
  const Upwind x = l;
  l = {swap ? r.a : x.a, swap ? r.w : x.w};
  r = {swap ? x.a : r.a, swap ? x.w : r.w};
}
/// The distance, in voxels, that agrees with as many axes as lie nearer than it.
MENISCUS_KERNEL_INLINE Float8 solve_eikonal(Upwind x, Upwind y, Upwind z) {
  const Float8 zero = set8(0), one = set8(1);
  order(x, y);
  order(y, z);
  order(x, y);
  // Values from here on are relative to the nearest axis: no cancellation.
  const Float8 b = y.a - x.a, c = z.a - x.a;
  const Int8 two = x.w * b * b < one;
  const Int8 three = two & (x.w * c * c + y.w * (c - b) * (c - b) < one);
  const Float8 wy = two ? y.w : zero, wz = three ? z.w : zero;
  const Float8 w = x.w + wy + wz, s = wy * b + wz * c, q = wy * b * b + wz * c * c - one;
  return x.a + (s + sqrt8(max8(s * s - w * q, zero))) / w;
}

float eikonal_body(float* halo, float voxel, float background, const RowLayers& rows) {
  const Float8 zero = set8(0), inverse = set8(1 / voxel), rim = set8(background * (1 / voxel));
  Float8 change = zero;
  for_rows_outwards(
      rows, [&](int row) __attribute__((always_inline)) {
        float* p = halo + halo_at(row >> 3, row & 7, 0);
        const Float8 o = load8(p);
        const Int8 beside = beside_surface(p);
        const Float8 sign = o < zero ? -inverse : inverse;
        const Nearer nx(p, kHaloX, sign), ny(p, kHaloY, sign), nz(p, 1, sign);
        const Float8 nearest = min8(min8(nx.value, ny.value), min8(nz.value, sign * o));
        if (bits8(nearest < rim) == 0) return;  // nothing but background around
        const Upwind x = nx.upwind(p, kHaloX, sign), y = ny.upwind(p, kHaloY, sign), z = nz.upwind(p, 1, sign);
        const Float8 distance = min8(solve_eikonal(x, y, z) * set8(voxel), set8(background));
        const Float8 r = beside ? o : o < zero ? -distance : distance;
        change = max8(change, abs8(r - o));
        store8(p, r);
      });
  float largest = 0;
  for (int l = 0; l < 8; ++l) largest = change[l] > largest ? change[l] : largest;
  return largest;
}

/// The square of the difference along one axis.
MENISCUS_KERNEL_INLINE Float8 slope_square(const float* p, int stride) {
  const Float8 zero = set8(0), m = load8(p - stride), o = load8(p), q = load8(p + stride);
  const Int8 inside = o < zero;
  const Float8 left = o - m, right = q - o;
  const Float8 crossing = max8((inside ^ (m < zero)) ? abs8(left) : zero, (inside ^ (q < zero)) ? abs8(right) : zero);
  const Float8 d = ((left < zero) ^ (right < zero)) ? crossing : set8(0.5f) * (left + right);
  return d * d;
}

/// The nearest crossing along one axis, in voxels; 2 when there is none.
MENISCUS_KERNEL_INLINE Float8 axis_crossing(const float* p, int stride) {
  const Float8 zero = set8(0), far = set8(2), o = load8(p), m = load8(p - stride), q = load8(p + stride);
  const Int8 inside = o < zero, left = inside ^ (m < zero), right = inside ^ (q < zero);
  return min8(left ? o / (o - m) : far, right ? o / (o - q) : far);
}

/// Slopes of the nodes next to the surface and how many there are (1 or 0), in the brick and one node around it.
struct Slopes {
  meniscus::band::Halo slope, count;

  explicit Slopes(const float* halo) {
    for (int i = -1; i < 9; ++i)
      for (int j = -1; j < 9; ++j)
        for (const int k : {-1, 1}) {
          const float* p = halo + halo_at(i, j, k);
          const Int8 beside = beside_surface(p);
          Float8 s = set8(0), c = s;
          if (bits8(beside) != 0) {
            c = beside ? set8(1) : c;
            s = beside ? sqrt8(slope_square(p, kHaloX) + slope_square(p, kHaloY) + slope_square(p, 1)) : s;
          }
          store8(slope + halo_at(i, j, k), s);
          store8(count + halo_at(i, j, k), c);
        }
  }

  /// Mean over each node of a row and its neighbours.
  Float8 mean(int row) {
    const int at = halo_at(row >> 3, row & 7, 0);
    Float8 s = load8(slope + at), c = load8(count + at);
    for (const int step : {-kHaloX, kHaloX, -kHaloY, kHaloY, -1, 1}) {
      s = s + load8(slope + at + step);
      c = c + load8(count + at + step);
    }
    return s / c;
  }
};

void rescale_body(const float* halo, float voxel, float* out) {
  const Float8 zero = set8(0);
  Slopes slopes(halo);
  for (int row = 0; row < 64; ++row) {
    const float* p = halo + halo_at(row >> 3, row & 7, 0);
    const Float8 o = load8(p);
    const Int8 beside = load8(slopes.count + (p - halo)) > zero;
    Float8 r = o;
    if (bits8(beside) != 0) {
      const Float8 along = min8(axis_crossing(p, kHaloX), min8(axis_crossing(p, kHaloY), axis_crossing(p, 1)));
      const Float8 d = set8(voxel) * min8(abs8(o) / max8(slopes.mean(row), set8(1e-20f)), along);
      r = beside ? (o < zero ? -d : d) : o;
    }
    store8(out + 8 * row, r);
  }
}

}  // namespace
