#pragma once

// Included by point_set_field.cpp and point_set_field.avx2.cpp: the same operations in the same order on four points at a
// time, compiled for two instruction sets. Private to them.
#include <meniscus/pointset/bspline.h>

#include <cstddef>
#include <cstdint>

namespace meniscus::pointset::field_kernel {

struct Domains {
  const double *x, *y, *z, *inverse2;                 ///< centres and 1/reach², in the index's order
  const std::uint32_t* order;                         ///< which point each is
  const double *nx, *ny, *nz, *reach, *coefficients;  ///< by point
  int grid;
  bool interpolate;
};

struct Range {
  std::uint32_t begin, end;
};

/// Rows of sums over the domains that contain a point: Σφs and its derivatives in the order x y z xx xy xz yy yz zz, the
/// same of Σφ, then the squared distance to the nearest centre among them and its number.
inline constexpr std::size_t kJet = 10;
inline constexpr std::size_t kNearest2 = 2 * kJet;
inline constexpr std::size_t kNearest = kNearest2 + 1;
inline constexpr std::size_t kRows = kNearest + 1;

/// rows[r * stride + i] for `size` points. Nobody near: sums of 0.
using Sum = void (*)(const Domains&, const Range* ranges, std::size_t count, const double* const (&x)[3], std::size_t size,
                     double* rows, std::size_t stride);
/// By level: value, gradient, Hessian.
extern const Sum kSumAvx2[3];

namespace {

typedef double Four __attribute__((vector_size(32)));
typedef long long Mask __attribute__((vector_size(32)));

inline Four all(double v) { return Four{} + v; }
inline Four load(const double* from, std::size_t lanes) {
  Four v = all(from[0]);
  for (std::size_t l = 1; l < 4; ++l) v[l] = from[l < lanes ? l : 0];
  return v;
}
inline bool any(Mask m) { return (m[0] | m[1] | m[2] | m[3]) != 0; }

/// A function's jet: value, gradient, Hessian (xx xy xz yy yz zz).
using Jet = Four[kJet];

/// Level 0 fills the value, 1 the gradient too, 2 all.
template <int Level>
inline void spline_jet(int g, const double* p, const Four (&x)[3], Jet& s) {
  Four n[3][3][8];
  for (int axis = 0; axis < 3; ++axis) bspline::jets(g, x[axis], n[axis][0], n[axis][1], n[axis][2]);
  for (std::size_t r = 0; r < kJet; ++r) s[r] = Four{};
  for (int a = 0; a < g; ++a) {
    Four e = Four{}, ew = e, eww = e, ev = e, evw = e, evv = e;
    for (int b = 0; b < g; ++b, p += g) {
      Four d = Four{}, dw = d, dww = d;
      for (int c = 0; c < g; ++c) {
        d += p[c] * n[2][0][c];
        if (Level > 0) dw += p[c] * n[2][1][c];
        if (Level > 1) dww += p[c] * n[2][2][c];
      }
      e += n[1][0][b] * d;
      if (Level > 0) ew += n[1][0][b] * dw, ev += n[1][1][b] * d;
      if (Level > 1) eww += n[1][0][b] * dww, evw += n[1][1][b] * dw, evv += n[1][2][b] * d;
    }
    s[0] += n[0][0][a] * e;
    if (Level > 0) s[1] += n[0][1][a] * e, s[2] += n[0][0][a] * ev, s[3] += n[0][0][a] * ew;
    if (Level > 1) {
      s[4] += n[0][2][a] * e, s[5] += n[0][1][a] * ev, s[6] += n[0][1][a] * ew;
      s[7] += n[0][0][a] * evv, s[8] += n[0][0][a] * evw, s[9] += n[0][0][a] * eww;
    }
  }
}

/// From derivatives along the frame's axes to the world's: `axes[k]` is axis k, times the rate of the spline's parameter.
template <int Level>
inline void to_world(const double (&axes)[3][3], Jet& s) {
  if (Level == 0) return;
  const Four g[3] = {s[1], s[2], s[3]};
  for (std::size_t i = 0; i < 3; ++i) s[1 + i] = g[0] * axes[0][i] + g[1] * axes[1][i] + g[2] * axes[2][i];
  if (Level == 1) return;
  const Four h[3][3] = {{s[4], s[5], s[6]}, {s[5], s[7], s[8]}, {s[6], s[8], s[9]}};
  Four m[3][3];
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t j = 0; j < 3; ++j) m[k][j] = h[k][0] * axes[0][j] + h[k][1] * axes[1][j] + h[k][2] * axes[2][j];
  std::size_t r = 4;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) s[r++] = axes[0][i] * m[0][j] + axes[1][i] * m[1][j] + axes[2][i] * m[2][j];
}

/// φ and its first two derivatives by t = |d|²/reach²; zero from t = 1 on.
template <int Level>
inline void weight(Four t, bool interpolate, Four& f, Four& f1, Four& f2) {
  const Four zero = Four{}, left = 1.0 - t, m = left > zero ? left : zero;
  const Four m2 = m * m;
  f = m2 * m2;
  f1 = -4.0 * m2 * m;
  f2 = 12.0 * m2;
  if (!interpolate) return;
  // Times (t + ε)⁻²: all but infinite at the centre, yet smooth.
  const Four q = 1.0 / (t + 1e-8), q2 = q * q, a = f, a1 = f1;
  f = a * q2;
  if (Level > 0) f1 = a1 * q2 - 2.0 * a * q2 * q;
  if (Level > 1) f2 = f2 * q2 - 4.0 * a1 * q2 * q + 6.0 * a * q2 * q2;
}

/// Adds φ·s to `sums` and φ to `weights`.
template <int Level>
inline void add(const Four (&d)[3], Four f, Four f1, Four f2, double inverse2, const Jet& s, Jet& sums, Jet& weights) {
  sums[0] += f * s[0];
  weights[0] += f;
  if (Level == 0) return;
  const Four first = f1 * (2 * inverse2), second = f2 * (4 * inverse2 * inverse2);
  Four w[3];
  for (std::size_t i = 0; i < 3; ++i) {
    w[i] = first * d[i];
    weights[1 + i] += w[i];
    sums[1 + i] += w[i] * s[0] + f * s[1 + i];
  }
  if (Level == 1) return;
  std::size_t r = 4;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j, ++r) {
      Four ww = second * d[i] * d[j];
      if (i == j) ww += first;
      weights[r] += ww;
      sums[r] += ww * s[0] + w[i] * s[1 + j] + w[j] * s[1 + i] + f * s[r];
    }
}

inline void frame_axes(double nx, double ny, double nz, double (&axes)[3][3]) {
  const double s = __builtin_copysign(1.0, nz), a = -1 / (s + nz), b = nx * ny * a;
  const double f[3][3] = {{1 + s * nx * nx * a, s * b, -s * nx}, {b, s + ny * ny * a, -ny}, {nx, ny, nz}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) axes[i][j] = f[i][j];
}

template <int Level>
void sum(const Domains& domains, const Range* ranges, std::size_t count, const double* const (&x)[3], std::size_t size,
         double* rows, std::size_t stride) {
  const auto cubed = static_cast<std::size_t>(domains.grid * domains.grid * domains.grid);
  for (std::size_t first = 0; first < size; first += 4) {
    const std::size_t lanes = size - first < 4 ? size - first : 4;
    const Four point[3] = {load(x[0] + first, lanes), load(x[1] + first, lanes), load(x[2] + first, lanes)};
    Jet sums, weights;
    for (std::size_t r = 0; r < kJet; ++r) sums[r] = weights[r] = Four{};
    Four nearest2 = all(1e300), nearest = Four{};
    for (std::size_t q = 0; q < count; ++q)
      for (std::uint32_t k = ranges[q].begin; k < ranges[q].end; ++k) {
        const Four d[3] = {point[0] - domains.x[k], point[1] - domains.y[k], point[2] - domains.z[k]};
        const Four d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2], t = d2 * domains.inverse2[k];
        const Mask inside = t < all(1);
        if (!any(inside)) continue;
        const std::size_t i = domains.order[k];
        const Mask nearer = inside & (d2 < nearest2);
        nearest2 = nearer ? d2 : nearest2;
        nearest = nearer ? all(static_cast<double>(i)) : nearest;

        double axes[3][3];
        frame_axes(domains.nx[i], domains.ny[i], domains.nz[i], axes);
        const double unit = 1 / domains.reach[i], rate = 0.5 * (domains.grid - 2) * unit;
        Four local[3];
        for (std::size_t a = 0; a < 3; ++a) {
          const Four u = (d[0] * axes[a][0] + d[1] * axes[a][1] + d[2] * axes[a][2]) * unit;
          local[a] = inside ? u : Four{};
          for (double& c : axes[a]) c *= rate;
        }
        Jet s;
        spline_jet<Level>(domains.grid, domains.coefficients + i * cubed, local, s);
        to_world<Level>(axes, s);
        Four f, f1, f2;
        weight<Level>(inside ? t : all(1), domains.interpolate, f, f1, f2);
        add<Level>(d, f, f1, f2, domains.inverse2[k], s, sums, weights);
      }
    for (std::size_t l = 0; l < lanes; ++l) {
      for (std::size_t r = 0; r < kJet; ++r) {
        rows[r * stride + first + l] = sums[r][l];
        rows[(kJet + r) * stride + first + l] = weights[r][l];
      }
      rows[kNearest2 * stride + first + l] = nearest2[l];
      rows[kNearest * stride + first + l] = nearest[l];
    }
  }
}

}  // namespace
}  // namespace meniscus::pointset::field_kernel
