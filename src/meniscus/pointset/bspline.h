#pragma once

// Uniform quadratic B-splines on [−1, 1], templated on the number type (plain or SIMD). Private to pointset/.

namespace meniscus::pointset::bspline {

/// The value of a plain number in every lane.
template <class T>
inline T all(double value) {
  return T{} + value;
}

/// N_a, and its first and second derivatives by the spline's own parameter, whose unit is one span: a grid of g control
/// points has g − 2 spans on [−1, 1]. `u` beyond the ends goes on as the last span's polynomial when g = 3.
template <class T>
inline void jets(int grid, T u, T* n, T* n1, T* n2) {
  if (grid == 3) {
    const T t = 0.5 * (u + 1.0), r = 1.0 - t;
    n[0] = 0.5 * r * r, n[1] = 0.5 + t * r, n[2] = 0.5 * t * t;
    n1[0] = -r, n1[1] = r - t, n1[2] = t;
    n2[0] = all<T>(1), n2[1] = all<T>(-2), n2[2] = all<T>(1);
    return;
  }
  const T t = (0.5 * (grid - 2)) * (u + 1.0), zero = all<T>(0);
  for (int a = 0; a < grid; ++a) {
    const T c = t - (a - 0.5), d = c < zero ? -c : c, r = 1.5 - d;
    const auto middle = d < zero + 0.5, outside = d >= zero + 1.5;
    n[a] = outside ? zero : (middle ? 0.75 - c * c : 0.5 * r * r);
    n1[a] = outside ? zero : (middle ? -2.0 * c : (c < zero ? r : -r));
    n2[a] = outside ? zero : (middle ? all<T>(-2) : all<T>(1));
  }
}

/// Coefficients of the function u itself: the control points' own places.
inline double greville(int grid, int a) { return (2.0 * a - (grid - 1)) / (grid - 2); }

template <class T>
inline void values(int grid, T u, T* n) {
  T n1[8], n2[8];
  jets(grid, u, n, n1, n2);
}

}  // namespace meniscus::pointset::bspline
