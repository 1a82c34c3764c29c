#pragma once

// The local function of one point while it changes: sampled, solved, evaluated. Private to pointset/.

#include <meniscus/pointset/bspline.h>
#include <meniscus/pointset/point_set.h>

#include <Eigen/LU>

#include <array>
#include <cmath>

namespace meniscus::pointset {

/// A local grid of G control points an axis, all sizes known to the compiler.
template <int G>
struct LocalSpline {
  static constexpr std::size_t kSamples = static_cast<std::size_t>(G) * G * G;
  using Samples = std::array<double, kSamples>;

  Samples coefficients;

  static double place(int a) { return kSampleExtent * (2.0 * a / (G - 1) - 1); }

  /// A: control points from values at the regular samples of one axis. Row-major.
  static const std::array<double, G * G>& inverse() {
    static const std::array<double, G* G> kInverse = [] {
      Eigen::Matrix<double, G, G> basis;
      for (int r = 0; r < G; ++r) {
        std::array<double, G> n;
        bspline::values(G, place(r), n.data());
        for (int c = 0; c < G; ++c) basis(r, c) = n[static_cast<std::size_t>(c)];
      }
      const Eigen::Matrix<double, G, G> inverse = basis.inverse();
      std::array<double, G * G> rows;
      for (int r = 0; r < G; ++r)
        for (int c = 0; c < G; ++c) rows[static_cast<std::size_t>(r * G + c)] = inverse(r, c);
      return rows;
    }();
    return kInverse;
  }

  /// p = (A⊗A⊗A) d, three small passes. [THEORY §6]
  static Samples solved(const Samples& samples) {
    const auto& inverse_rows = inverse();
    Samples from = samples, to;
    for (int pass = 0; pass < 3; ++pass) {
      for (std::size_t rest = 0; rest < G * G; ++rest)
        for (std::size_t r = 0; r < G; ++r) {
          double sum = 0;
          for (std::size_t a = 0; a < G; ++a) sum += inverse_rows[r * G + a] * from[a * G * G + rest];
          to[rest * G + r] = sum;
        }
      from = to;
    }
    return from;
  }

  struct Jet {
    double value;
    Vec3 gradient;  // by local coordinates
  };
  /// s and ∇s at local coordinates.
  static Jet at(const Samples& coefficients, const Vec3& local) {
    std::array<double, G> n[3], d[3], unused;
    for (int axis = 0; axis < 3; ++axis) bspline::jets(G, local[axis], n[axis].data(), d[axis].data(), unused.data());
    double f = 0, fu = 0, fv = 0, fw = 0;
    for (std::size_t a = 0; a < G; ++a)
      for (std::size_t b = 0; b < G; ++b) {
        const double* p = coefficients.data() + (a * G + b) * G;
        double s = 0, sw = 0;
        for (std::size_t c = 0; c < G; ++c) s += p[c] * n[2][c], sw += p[c] * d[2][c];
        f += n[0][a] * n[1][b] * s;
        fu += d[0][a] * n[1][b] * s;
        fv += n[0][a] * d[1][b] * s;
        fw += n[0][a] * n[1][b] * sw;
      }
    return {f, 0.5 * (G - 2) * Vec3(fu, fv, fw)};
  }
};

/// Sample (a, b, c) of a domain stands at position + lattice · ((2a, 2b, 2c)/(g−1) − 1); the columns are u, v and w.
inline Mat3 sample_axes(const Vec3& normal, double reach) {
  const Frame frame = frame_about(normal);
  Mat3 axes;
  axes << reach * frame.u, reach * frame.v, reach * frame.w;
  return axes;
}

}  // namespace meniscus::pointset
