#pragma once

// Private to kernel_bodies.h: the piecewise linear surface within cells.
#include <meniscus/band/float8.h>
#include <meniscus/band/kernels.h>

namespace {

using meniscus::band::halo_at;
using meniscus::band::kHaloX;
using meniscus::band::kHaloY;

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

}  // namespace
