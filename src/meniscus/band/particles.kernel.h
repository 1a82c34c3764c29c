#pragma once

// Private to kernel_bodies.h: sums over particles.
#include <meniscus/band/float8.h>
#include <meniscus/band/kernels.h>

namespace {

using meniscus::band::ParticleLanes;

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

}  // namespace
