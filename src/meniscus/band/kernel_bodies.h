#pragma once

#include <meniscus/band/float8.h>
#include <meniscus/band/kernels.h>

// Bodies of the kernels, compiled once per processor family (see float8.h).
namespace {

using meniscus::band::halo_at;
using meniscus::band::kHaloX;
using meniscus::band::kHaloY;
using meniscus::band::ParticleLanes;
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

void step_body(const float* halo, const float* speed, const float* previous, const StepCoefficients& s, float* out) {
  const Float8 zero = set8(0), one = set8(1), background = set8(s.background), inverse = set8(1 / s.voxel);
  const Float8 scale = inverse;  // values are made lengths per voxel, so that the tiny number above has no unit
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {
      const float* p = halo + halo_at(i, j, 0);
      const int row = (i * 8 + j) * 8;
      const Float8 o = load8(p);
      Float8 rate = zero;
      if (speed != nullptr) {
        const Float8 v = load8(speed + row);
        const Float8 side = v > zero ? one : -one;
        const Float8 g = upwind_square(p, kHaloX, side) + upwind_square(p, kHaloY, side) + upwind_square(p, 1, side);
        rate = rate - v * (sqrt8(g) * scale);
      }
      if (s.tension != 0) {
        // The stencil of a node next to clamped ones sees their kink: tension fades out over the voxel before.
        const Float8 fade = min8(max8((background - abs8(o)) * inverse - one, zero), one);
        rate = rate + set8(s.tension) * fade * (curvature_rate(p) * (inverse * inverse));
      }
      Float8 r = o + set8(s.c) * rate;
      if (previous != nullptr) r = r + set8(s.b) * (load8(previous + row) - o);
      store8(out + row, min8(max8(r, -background), background));
    }
}

/// All bits set where a node has a neighbour on the other side of the surface.
MENISCUS_KERNEL_INLINE auto beside_surface(const float* p) {
  const Float8 zero = set8(0);
  const auto inside = load8(p) < zero;
  return (inside ^ (load8(p - kHaloX) < zero)) | (inside ^ (load8(p + kHaloX) < zero)) |
         (inside ^ (load8(p - kHaloY) < zero)) | (inside ^ (load8(p + kHaloY) < zero)) | (inside ^ (load8(p - 1) < zero)) |
         (inside ^ (load8(p + 1) < zero));
}

MENISCUS_KERNEL_INLINE void add_upwind(const float* phi, const float* speed, int stride, Float8 here, Float8& sum,
                                       Float8& weights) {
  const Float8 zero = set8(0);
  const Float8 m = abs8(load8(phi - stride)), p = abs8(load8(phi + stride));
  const Float8 v = m < p ? load8(speed - stride) : load8(speed + stride);
  Float8 w = max8(here - min8(m, p), zero);
  w = v == v ? w : zero;
  sum = sum + w * (v == v ? v : zero);
  weights = weights + w;
}

void extend_body(const float* phi_halo, const float* speed_halo, float* out) {
  const Float8 zero = set8(0);
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {
      const float* f = phi_halo + halo_at(i, j, 0);
      const float* v = speed_halo + halo_at(i, j, 0);
      const Float8 here = abs8(load8(f));
      Float8 sum = zero, weights = zero;
      add_upwind(f, v, kHaloX, here, sum, weights);
      add_upwind(f, v, kHaloY, here, sum, weights);
      add_upwind(f, v, 1, here, sum, weights);
      const Float8 own = load8(v);
      const Float8 mean = weights > zero ? sum / (weights > zero ? weights : set8(1)) : own;
      store8(out + (i * 8 + j) * 8, beside_surface(f) ? own : mean);
    }
}

/// One axis of the eikonal stencil: (u - a)² w = 1, in voxels.
struct Upwind {
  Float8 a, w;
};
MENISCUS_KERNEL_INLINE Upwind upwind_of(const float* p, int stride, Float8 sign) {
  const Float8 m = sign * load8(p - stride), q = sign * load8(p + stride);
  const Float8 near = min8(m, q);
  const Float8 far = m < q ? sign * load8(p - 2 * stride) : sign * load8(p + 2 * stride);
  const auto second = far < near;
  const Float8 third = set8(1.0f / 3.0f);
  return {second ? near + (near - far) * third : near, second ? set8(2.25f) : set8(1)};
}
MENISCUS_KERNEL_INLINE void order(Upwind& l, Upwind& r) {
  const auto swap = r.a < l.a;
  const Upwind x = l;
  l = {swap ? r.a : x.a, swap ? r.w : x.w};
  r = {swap ? x.a : r.a, swap ? x.w : r.w};
}

float eikonal_body(const float* halo, float voxel, float background, float* out) {
  const Float8 zero = set8(0), one = set8(1), inverse = set8(1 / voxel);
  Float8 change = zero;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {
      const float* p = halo + halo_at(i, j, 0);
      const Float8 o = load8(p);
      const Float8 sign = o < zero ? -inverse : inverse;
      Upwind x = upwind_of(p, kHaloX, sign), y = upwind_of(p, kHaloY, sign), z = upwind_of(p, 1, sign);
      order(x, y);
      order(y, z);
      order(x, y);
      // Values from here on are relative to the nearest axis: no cancellation.
      const Float8 b = y.a - x.a, c = z.a - x.a;
      const Float8 u1 = one / sqrt8(x.w);
      const Float8 w2 = x.w + y.w, s2 = y.w * b;
      const Float8 u2 = (s2 + sqrt8(max8(s2 * s2 - w2 * (s2 * b - one), zero))) / w2;
      const Float8 w3 = w2 + z.w, s3 = s2 + z.w * c;
      const Float8 u3 = (s3 + sqrt8(max8(s3 * s3 - w3 * (s2 * b + z.w * c * c - one), zero))) / w3;
      Float8 u = u1 > b ? u2 : u1;
      u = ((u1 > b) & (u2 > c)) ? u3 : u;
      const Float8 distance = min8((x.a + u) * set8(voxel), set8(background));
      const Float8 solved = o < zero ? -distance : distance;
      const Float8 r = beside_surface(p) ? o : solved;
      change = max8(change, abs8(r - o));
      store8(out + (i * 8 + j) * 8, r);
    }
  float largest = 0;
  for (int l = 0; l < 8; ++l) largest = change[l] > largest ? change[l] : largest;
  return largest;
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

constexpr meniscus::band::Kernels kSet = {step_body, extend_body, eikonal_body, averaged_body, density_body};

}  // namespace
