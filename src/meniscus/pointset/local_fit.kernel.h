#pragma once

// Included by local_fit.cpp and local_fit.avx2.cpp: the least-squares problems of four points at once, one a lane, compiled
// for two instruction sets with the same operations in the same order. Private to them.

#include <cmath>
#include <cstddef>

namespace meniscus::pointset::fit_kernel {

inline constexpr std::size_t kLanes = 4;
inline constexpr std::size_t kUnknowns = 27;
inline constexpr std::size_t kPacked = kUnknowns * (kUnknowns + 1) / 2;

/// One row of each of the four problems, in local coordinates: value `target` at (u, v, w), and, in the gradient variant,
/// gradient (gu, gv, gw). Lanes without a row have weight 0.
struct Row {
  alignas(32) double u[kLanes];
  double v[kLanes], w[kLanes], weight[kLanes], target[kLanes];
  double gu[kLanes], gv[kLanes], gw[kLanes];
};

/// Solves for the 27 coefficients of u^a v^b w^c, number (3 a + b) 3 + c, a, b, c <= 2. `regular` is a packed lower triangle
/// added to the normal equations once their weights sum to one; `gradient` the weight of gradients, 0 for none.
using Solve = void (*)(const Row* rows, std::size_t count, double gradient, const double* regular,
                       double (*solution)[kLanes]);
void solve_avx2(const Row* rows, std::size_t count, double gradient, const double* regular, double (*solution)[kLanes]);

namespace {

typedef double Four __attribute__((vector_size(32)));

inline Four load(const double* p) { return *reinterpret_cast<const Four*>(p); }
inline Four root(Four v) {
  for (std::size_t l = 0; l < kLanes; ++l) v[l] = __builtin_sqrt(v[l]);
  return v;
}

/// Normal equations of monomials need only the moments Σ weight u^a v^b w^c with a, b, c <= 4: 125 sums instead of 378.
struct Moments {
  Four m[5][5][5];
  Four rhs[3][3][3];
};

inline void add_row(Moments& s, const Row& row, double gradient) {
  const Four u = load(row.u), v = load(row.v), w = load(row.w), weight = load(row.weight), target = load(row.target);
  const Four one = Four{} + 1;
  const Four pu[5] = {one, u, u * u, u * u * u, u * u * u * u};
  const Four pv[5] = {one, v, v * v, v * v * v, v * v * v * v};
  const Four pw[5] = {one, w, w * w, w * w * w, w * w * w * w};
  for (int a = 0; a < 5; ++a) {
    const Four wa = weight * pu[a];
    for (int b = 0; b < 5; ++b) {
      const Four wab = wa * pv[b];
      for (int c = 0; c < 5; ++c) s.m[a][b][c] += wab * pw[c];
    }
  }
  const Four wt = weight * target;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      const Four t = wt * pu[a] * pv[b];
      for (int c = 0; c < 3; ++c) s.rhs[a][b][c] += t * pw[c];
    }
  if (!(gradient > 0)) return;
  const Four gu = gradient * weight * load(row.gu), gv = gradient * weight * load(row.gv),
             gw = gradient * weight * load(row.gw);
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      for (int c = 0; c < 3; ++c) {
        Four t = Four{};
        if (a > 0) t += gu * static_cast<double>(a) * pu[a - 1] * pv[b] * pw[c];
        if (b > 0) t += gv * static_cast<double>(b) * pu[a] * pv[b - 1] * pw[c];
        if (c > 0) t += gw * static_cast<double>(c) * pu[a] * pv[b] * pw[c - 1];
        s.rhs[a][b][c] += t;
      }
}

/// The normal matrix, packed by rows of its lower triangle.
inline void normal_matrix(const Moments& s, Four scale, double gradient, const double* regular, Four* matrix) {
  std::size_t k = 0;
  for (int i = 0; i < static_cast<int>(kUnknowns); ++i)
    for (int j = 0; j <= i; ++j, ++k) {
      const int a[2] = {i / 9, j / 9}, b[2] = {i / 3 % 3, j / 3 % 3}, c[2] = {i % 3, j % 3};
      const int sa = a[0] + a[1], sb = b[0] + b[1], sc = c[0] + c[1];
      Four m = s.m[sa][sb][sc];
      if (gradient > 0) {
        if (a[0] * a[1] > 0) m += gradient * a[0] * a[1] * s.m[sa - 2][sb][sc];
        if (b[0] * b[1] > 0) m += gradient * b[0] * b[1] * s.m[sa][sb - 2][sc];
        if (c[0] * c[1] > 0) m += gradient * c[0] * c[1] * s.m[sa][sb][sc - 2];
      }
      matrix[k] = m * scale + regular[k];
    }
}

/// Cholesky factor in place, the inverses of its diagonal instead of the diagonal; then both substitutions.
inline void solve_cholesky(Four* matrix, Four* x) {
  const auto row = [&](std::size_t i) { return matrix + i * (i + 1) / 2; };
  const Four tiny = Four{} + 1e-30;
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    Four* ri = row(i);
    for (std::size_t j = 0; j < i; ++j) {
      const Four* rj = row(j);
      Four sum = ri[j];
      for (std::size_t k = 0; k < j; ++k) sum -= ri[k] * rj[k];
      ri[j] = sum * rj[j];
    }
    Four sum = ri[i];
    for (std::size_t k = 0; k < i; ++k) sum -= ri[k] * ri[k];
    ri[i] = 1.0 / root(sum > tiny ? sum : tiny);
  }
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    for (std::size_t k = 0; k < i; ++k) x[i] -= row(i)[k] * x[k];
    x[i] *= row(i)[i];
  }
  for (std::size_t i = kUnknowns; i-- > 0;) {
    x[i] *= row(i)[i];
    for (std::size_t k = 0; k < i; ++k) x[k] -= row(i)[k] * x[i];
  }
}

inline void solve(const Row* rows, std::size_t count, double gradient, const double* regular, double (*solution)[kLanes]) {
  Moments s{};
  for (std::size_t r = 0; r < count; ++r) add_row(s, rows[r], gradient);
  const Four zero = Four{}, scale = s.m[0][0][0] > zero ? 1.0 / s.m[0][0][0] : zero;
  Four matrix[kPacked];
  normal_matrix(s, scale, gradient, regular, matrix);
  Four x[kUnknowns];
  for (int i = 0; i < static_cast<int>(kUnknowns); ++i) x[i] = s.rhs[i / 9][i / 3 % 3][i % 3] * scale;
  solve_cholesky(matrix, x);
  for (std::size_t i = 0; i < kUnknowns; ++i)
    for (std::size_t l = 0; l < kLanes; ++l) solution[i][l] = x[i][l];
}

}  // namespace
}  // namespace meniscus::pointset::fit_kernel
