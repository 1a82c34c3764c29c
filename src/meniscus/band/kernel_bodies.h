#pragma once

#include <meniscus/band/float8.h>
#include <meniscus/band/kernels.h>

#include <cstring>

// Bodies of the kernels, compiled once per processor family (see float8.h).
namespace {

using meniscus::band::halo_at;
using meniscus::band::kHaloX;
using meniscus::band::kHaloY;
using meniscus::band::ParticleLanes;
using meniscus::band::Rows;
using meniscus::band::StepCoefficients;

/// Squared Godunov difference along one axis for a front of direction `side` (+1 outwards), in values per node.
MENISCUS_KERNEL_INLINE Float8 upwind_square(const float* p, int stride, Float8 side) {
  const Float8 mm = load8(p - 2 * stride), m = load8(p - stride), o = load8(p), q = load8(p + stride),
               qq = load8(p + 2 * stride);
  const Float8 dm = o - m, dp = q - o;
  const Float8 bend = dp - dm;
  const Float8 left = dm + set8(0.5f) * minmod8(dm - (m - mm), bend);
  const Float8 right = dp - set8(0.5f) * minmod8(bend, (qq - q) - dp);
  const Float8 u = max8(max8(side * left, -side * right), set8(0));
  return u * u;
}

/// κ |∇φ|, in values per node² (central differences); |κ| at most 2 per node.
MENISCUS_KERNEL_INLINE Float8 curvature_rate(const float* p) {
  const Float8 half = set8(0.5f), two = set8(2), tiny = set8(1e-12f);
  const Float8 o = load8(p);
  const Float8 xm = load8(p - kHaloX), xp = load8(p + kHaloX), ym = load8(p - kHaloY), yp = load8(p + kHaloY),
               zm = load8(p - 1), zp = load8(p + 1);
  const Float8 fx = half * (xp - xm), fy = half * (yp - ym), fz = half * (zp - zm);
  const Float8 fxx = (xp - o) - (o - xm), fyy = (yp - o) - (o - ym), fzz = (zp - o) - (o - zm);
  const Float8 quarter = set8(0.25f);
  const Float8 fxy = quarter * ((load8(p + kHaloX + kHaloY) - load8(p - kHaloX + kHaloY)) -
                                (load8(p + kHaloX - kHaloY) - load8(p - kHaloX - kHaloY)));
  const Float8 fxz =
      quarter * ((load8(p + kHaloX + 1) - load8(p - kHaloX + 1)) - (load8(p + kHaloX - 1) - load8(p - kHaloX - 1)));
  const Float8 fyz =
      quarter * ((load8(p + kHaloY + 1) - load8(p - kHaloY + 1)) - (load8(p + kHaloY - 1) - load8(p - kHaloY - 1)));
  const Float8 xx = fx * fx, yy = fy * fy, zz = fz * fz;
  const Float8 square = xx + yy + zz;
  const Float8 bent =
      fxx * (yy + zz) + fyy * (xx + zz) + fzz * (xx + yy) - two * (fx * fy * fxy + fx * fz * fxz + fy * fz * fyz);
  const Float8 limit = two * sqrt8(square);
  return min8(max8(bent / (square + tiny), -limit), limit);
}

MENISCUS_KERNEL_INLINE bool any_nearer(const float* row, Float8 limit) { return bits8(abs8(load8(row)) < limit) != 0; }

/// Calls work(row) for every row of the set, those that come nearest to the surface first.
template <class Work>
MENISCUS_KERNEL_INLINE void for_rows_outwards(const float* halo, Rows rows, float background, const Work& work) {
  constexpr int kLayers = 4;
  for (int layer = 1; layer <= kLayers && rows != 0; ++layer) {
    const Float8 limit = set8(background * static_cast<float>(layer) / kLayers);
    Rows left = 0;
    for (Rows r = rows; r != 0; r &= r - 1) {
      const int row = __builtin_ctzll(r);
      if (layer == kLayers || any_nearer(halo + halo_at(row >> 3, row & 7, 0), limit))
        work(row);
      else
        left |= r & -r;
    }
    rows = left;
  }
}

/// Rows that a halo must hold, a bit 2 + j for each in the numbers 2 + i: those that stencils of `rows` read. kCorners:
/// stencils that reach a node across edges too.
template <bool kCorners>
struct NeededRows {
  unsigned bits[12] = {};

  explicit NeededRows(Rows rows) {
    for (unsigned& b : bits) b = rows == meniscus::band::kAllRows ? 0xFFFu : 0;
    for (int i = 0; i < 8; ++i) {
      const unsigned own = static_cast<unsigned>(rows >> (8 * i) & 0xFFu) << 2, wide = own | own << 1 | own >> 1;
      bits[i + 2] |= wide | own << 2 | own >> 2;
      for (const int near : {i + 1, i + 3}) bits[near] |= kCorners ? wide : own;
      for (const int far : {i, i + 4}) bits[far] |= own;
    }
  }
};

/// The rows of one column of bricks along k that a halo holds; kRims: with what borders on their ends.
template <bool kRims>
MENISCUS_KERNEL_INLINE void gather_column(const meniscus::band::RowSource* source, int dx, int dy, const unsigned* needed,
                                          float* halo) {
  const meniscus::band::RowSource* column = source + (dx + 1) * 9 + (dy + 1) * 3;
  const meniscus::band::RowSource behind = column[0], own = column[1], ahead = column[2];
  const int i_begin = dx < 0 ? -2 : dx > 0 ? 8 : 0, i_end = dx < 0 ? 0 : dx > 0 ? 10 : 8;
  const unsigned part = dy < 0 ? 0x003u : dy > 0 ? 0xC00u : 0x3FCu;
  for (int i = i_begin; i < i_end; ++i)
    for (unsigned left = needed[i + 2] & part; left != 0; left &= left - 1) {
      const int j = __builtin_ctz(left) - 2;
      const auto row = static_cast<std::size_t>((i & 7) * 8 + (j & 7));
      float* to = halo + halo_at(i, j, 0);
      if (kRims) std::memcpy(to - 2, behind.first + row * behind.stride + 6, 2 * sizeof(float));
      store8(to, load8(own.first + row * own.stride));
      if (kRims) std::memcpy(to + 8, ahead.first + row * ahead.stride, 2 * sizeof(float));
    }
}

/// The brick itself, all of it.
MENISCUS_KERNEL_INLINE void gather_own(const meniscus::band::RowSource& own, float* halo) {
  for (std::size_t row = 0; row < 64; ++row)
    store8(halo + halo_at(static_cast<int>(row >> 3), static_cast<int>(row & 7), 0), load8(own.first + row * own.stride));
}

void gather_body(const meniscus::band::RowSource* source, Rows rows, float* halo) {
  const NeededRows<true> needed(rows);
  gather_own(source[13], halo);
  for (int dx = -1; dx <= 1; ++dx)
    for (int dy = -1; dy <= 1; ++dy) gather_column<true>(source, dx, dy, needed.bits, halo);
}

void gather_star_body(const meniscus::band::RowSource* source, Rows rows, float* halo) {
  const NeededRows<false> needed(rows);
  gather_own(source[13], halo);
  gather_column<true>(source, 0, 0, needed.bits, halo);
  gather_column<false>(source, -1, 0, needed.bits, halo);
  gather_column<false>(source, 1, 0, needed.bits, halo);
  gather_column<false>(source, 0, -1, needed.bits, halo);
  gather_column<false>(source, 0, 1, needed.bits, halo);
}

void centre_body(const float* halo, float* out) {
  for (int row = 0; row < 64; ++row) store8(out + 8 * row, load8(halo + halo_at(row >> 3, row & 7, 0)));
}

template <class Test>
MENISCUS_KERNEL_INLINE void bits_where(const float* samples, meniscus::band::NodeBits& bits, const Test& test) {
  for (std::size_t i = 0; i < 8; ++i) {
    std::uint64_t plane = 0;
    for (std::size_t j = 0; j < 8; ++j)
      plane |= static_cast<std::uint64_t>(bits8(test(load8(samples + (i * 8 + j) * 8)))) << (8 * j);
    bits[i] = plane;
  }
}
void inside_body(const float* samples, meniscus::band::NodeBits& bits) {
  bits_where(
      samples, bits, [](Float8 v) __attribute__((always_inline)) { return v < set8(0); });
}
void nearer_body(const float* samples, float limit, meniscus::band::NodeBits& bits) {
  bits_where(
      samples, bits, [limit](Float8 v) __attribute__((always_inline)) { return abs8(v) < set8(limit); });
}

void step_body(const float* halo, const float* speed, const float* previous, const StepCoefficients& s, Rows rows,
               float* out) {
  const Float8 zero = set8(0), one = set8(1), background = set8(s.background), inverse = set8(1 / s.voxel);
  for (int row = 0; row < 64; ++row) {
    const float* p = halo + halo_at(row >> 3, row & 7, 0);
    const Float8 o = load8(p);
    if ((rows >> row & 1) == 0) {
      store8(out + 8 * row, o);
      continue;
    }
    Float8 rate = zero;
    if (speed != nullptr) {
      const Float8 given = load8(speed + (p - halo));
      const Float8 v = given == given ? given : zero;
      const Float8 side = v > zero ? one : -one;
      const Float8 g = upwind_square(p, kHaloX, side) + upwind_square(p, kHaloY, side) + upwind_square(p, 1, side);
      rate = rate - v * (sqrt8(g) * inverse);
    }
    // The stencil of a node next to clamped ones sees their kink: tension fades out over the voxel before.
    const Float8 fade = min8(max8((background - abs8(o)) * inverse - one, zero), one);
    if (s.tension != 0 && bits8(fade > zero) != 0)
      rate = rate + set8(s.tension) * fade * (curvature_rate(p) * (inverse * inverse));
    Float8 r = o + set8(s.c) * rate;
    if (previous != nullptr) r = r + set8(s.b) * (load8(previous + 8 * row) - o);
    store8(out + 8 * row, min8(max8(r, -background), background));
  }
}

/// Where a node has a neighbour on the other side of the surface.
MENISCUS_KERNEL_INLINE Int8 beside_surface(const float* p) {
  const Float8 zero = set8(0);
  const Int8 inside = load8(p) < zero;
  return (inside ^ (load8(p - kHaloX) < zero)) | (inside ^ (load8(p + kHaloX) < zero)) |
         (inside ^ (load8(p - kHaloY) < zero)) | (inside ^ (load8(p + kHaloY) < zero)) | (inside ^ (load8(p - 1) < zero)) |
         (inside ^ (load8(p + 1) < zero));
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

void extend_body(const float* phi_halo, float* speed_halo, float background, Rows rows) {
  const Float8 zero = set8(0), one = set8(1);
  constexpr int kAlongRow = 2;  // steps along the row per visit
  for_rows_outwards(
      phi_halo, rows, background, [&](int row) __attribute__((always_inline)) {
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
MENISCUS_KERNEL_INLINE Upwind upwind_of(const float* row, int stride, Float8 sign) {
  const Float8 m = sign * load8(row - stride), p = sign * load8(row + stride);
  const Float8 near = min8(m, p);
  const Float8 far = sign * (m < p ? load8(row - 2 * stride) : load8(row + 2 * stride));
  const Int8 second = far < near;
  return {second ? near + (near - far) * set8(1.0f / 3.0f) : near, second ? set8(2.25f) : set8(1)};
}
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

float eikonal_body(float* halo, float voxel, float background, Rows rows) {
  const Float8 zero = set8(0), inverse = set8(1 / voxel);
  Float8 change = zero;
  for_rows_outwards(
      halo, rows, background, [&](int row) __attribute__((always_inline)) {
        float* p = halo + halo_at(row >> 3, row & 7, 0);
        const Float8 o = load8(p);
        const Int8 beside = beside_surface(p);
        const Float8 sign = o < zero ? -inverse : inverse;
        const Upwind x = upwind_of(p, kHaloX, sign), y = upwind_of(p, kHaloY, sign), z = upwind_of(p, 1, sign);
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

std::size_t cut_cells_body(const float* halo, std::uint16_t* cells) {
  unsigned inside[9][9];  // a bit per node of a row, the first one of the next brick included
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j) {
      const float* p = halo + halo_at(i, j, 0);
      inside[i][j] = bits8(load8(p) < set8(0)) | static_cast<unsigned>(p[8] < 0) << 8;
    }
  std::size_t count = 0;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {
      const unsigned any = inside[i][j] | inside[i + 1][j] | inside[i][j + 1] | inside[i + 1][j + 1];
      const unsigned all = inside[i][j] & inside[i + 1][j] & inside[i][j + 1] & inside[i + 1][j + 1];
      for (unsigned cut = (any | any >> 1) & ~(all & all >> 1) & 0xFFu; cut != 0; cut &= cut - 1)
        cells[count++] = static_cast<std::uint16_t>((i * 8 + j) * 8 + __builtin_ctz(cut));
    }
  return count;
}

/// Area over slope of the zero set of the linear function with these values at a tetrahedron's corners (six of which make
/// a unit cube): half the quadratic B-spline with the values as knots, at zero.
MENISCUS_KERNEL_INLINE Float8 zero_density(Float8 a, Float8 b, Float8 c, Float8 d) {
  const Float8 zero = set8(0), l = min8(a, b), m = max8(a, b), n = min8(c, d), o = max8(c, d);
  const Float8 p = max8(l, n), q = min8(m, o);
  const Float8 t0 = min8(l, n), t1 = min8(p, q), t2 = max8(p, q), t3 = max8(m, o);
  const Float8 one_in = t0 * t0, two_in = -t0 * t2 * (t3 - t1) - t3 * t1 * (t2 - t0), three_in = t3 * t3;
  const Float8 one_span = (t1 - t0) * (t2 - t0) * (t3 - t0);
  const Float8 two_span = (t2 - t0) * (t2 - t1) * (t3 - t1) * (t3 - t0);
  const Float8 three_span = (t3 - t0) * (t3 - t1) * (t3 - t2);
  const Int8 one = t1 >= zero, three = t2 < zero;
  const Float8 above = one ? one_in : three ? three_in : two_in, below = one ? one_span : three ? three_span : two_span;
  const Int8 cut = (t0 < zero) & (t3 >= zero) & (below > zero);
  return cut ? set8(0.5f) * above / below : zero;
}

void surface_part_body(const float* halo, float scale, const std::uint16_t* cells, std::size_t count,
                       meniscus::band::SurfacePart& part) {
  // Corners 1, 2 and 4 lie along x, y and z. A tetrahedron goes from corner 0 by one, two and three axes to corner 7.
  constexpr int kOrder[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  Float8 area = set8(0), flux = area, normal[3] = {area, area, area};
  for (std::size_t first = 0; first < count; first += 8) {
    float corner[8][8], at[3][8];
    for (std::size_t lane = 0; lane < 8; ++lane) {
      const int cell = first + lane < count ? cells[first + lane] : -1;
      const float* p = halo + halo_at(cell >> 6 & 7, cell >> 3 & 7, cell & 7);
      for (int q = 0; q < 8; ++q)
        corner[q][lane] = cell < 0 ? 1 : scale * p[(q & 1) * kHaloX + (q >> 1 & 1) * kHaloY + (q >> 2)];
      for (int a = 0; a < 3; ++a) at[a][lane] = static_cast<float>(cell >> (6 - 3 * a) & 7);
    }
    const Float8 start = load8(corner[0]);
    for (const auto& axis : kOrder) {
      const Float8 b = load8(corner[1 << axis[0]]), c = load8(corner[1 << axis[0] | 1 << axis[1]]), d = load8(corner[7]);
      const Float8 density = zero_density(start, b, c, d);
      Float8 g[3];
      g[axis[0]] = b - start;
      g[axis[1]] = c - b;
      g[axis[2]] = d - c;
      area = area + density * sqrt8(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
      flux = flux + density * (g[0] * load8(at[0]) + g[1] * load8(at[1]) + g[2] * load8(at[2]) - start);
      for (int a = 0; a < 3; ++a) normal[a] = normal[a] + density * g[a];
    }
  }
  part = {};
  for (int lane = 0; lane < 8; ++lane) {
    part.area += area[lane];
    part.flux += flux[lane];
    for (int a = 0; a < 3; ++a) part.normal[a] += normal[a][lane];
  }
}

void averaged_body(const ParticleLanes& p, const float* px, const float* py, const float* pz, float* out) {
  const Float8 zero = set8(0), one = set8(1);
  const Float8 x = load8(px), y = load8(py), z = load8(pz);
  Float8 sw = zero, sx = zero, sy = zero, sz = zero, sr = zero;
  for (std::size_t c = 0; c < p.count; ++c) {
    const Float8 cx = set8(p.x[c]), cy = set8(p.y[c]), cz = set8(p.z[c]);
    const Float8 dx = x - cx, dy = y - cy, dz = z - cz;
    const Float8 q = max8(one - (dx * dx + dy * dy + dz * dz) * set8(p.metric[c]), zero);
    const Float8 w = set8(p.weight[c]) * (q * q * q);
    sw = sw + w;
    sx = sx + w * cx;
    sy = sy + w * cy;
    sz = sz + w * cz;
    sr = sr + w * set8(p.radius[c]);
  }
  store8(out, sw);
  store8(out + 8, sx);
  store8(out + 16, sy);
  store8(out + 24, sz);
  store8(out + 32, sr);
}

void density_body(const ParticleLanes& p, const float* px, const float* py, const float* pz, float* out) {
  const Float8 zero = set8(0), one = set8(1);
  const Float8 x = load8(px), y = load8(py), z = load8(pz);
  Float8 s = zero, sx = zero, sy = zero, sz = zero;
  const float* m = p.metric;
  const std::size_t n = p.count;
  for (std::size_t c = 0; c < n; ++c) {
    const Float8 dx = x - set8(p.x[c]), dy = y - set8(p.y[c]), dz = z - set8(p.z[c]);
    const Float8 gx = set8(m[c]) * dx + set8(m[n + c]) * dy + set8(m[2 * n + c]) * dz;
    const Float8 gy = set8(m[n + c]) * dx + set8(m[3 * n + c]) * dy + set8(m[4 * n + c]) * dz;
    const Float8 gz = set8(m[2 * n + c]) * dx + set8(m[4 * n + c]) * dy + set8(m[5 * n + c]) * dz;
    const Float8 q = max8(one - (gx * dx + gy * dy + gz * dz), zero);
    const Float8 w = set8(p.weight[c]) * (q * q);
    s = s + w * q;
    const Float8 slope = set8(-6) * w;
    sx = sx + slope * gx;
    sy = sy + slope * gy;
    sz = sz + slope * gz;
  }
  store8(out, s);
  store8(out + 8, sx);
  store8(out + 16, sy);
  store8(out + 24, sz);
}

constexpr meniscus::band::Kernels kSet = {gather_body,       gather_star_body, centre_body,  inside_body,  nearer_body,
                                          step_body,         extend_body,      eikonal_body, rescale_body, cut_cells_body,
                                          surface_part_body, averaged_body,    density_body};

}  // namespace
