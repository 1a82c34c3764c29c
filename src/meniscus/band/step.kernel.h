#pragma once

// Private to kernel_bodies.h: transport and tension.
#include <meniscus/band/float8.h>
#include <meniscus/band/kernels.h>

namespace {

using meniscus::band::halo_at;
using meniscus::band::kHaloX;
using meniscus::band::kHaloY;
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

}  // namespace
