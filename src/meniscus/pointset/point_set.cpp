#include <meniscus/base/error.h>
#include <meniscus/pointset/bspline.h>
#include <meniscus/pointset/point_set.h>

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace meniscus::pointset {
namespace {

template <class Set, class Visit>
void for_arrays(Set& set, const Visit& visit) {
  for (auto* a : {&set.x, &set.y, &set.z, &set.nx, &set.ny, &set.nz, &set.bx, &set.by, &set.bz, &set.reach}) visit(*a);
}

double sample_place(int grid, int a) { return kSampleExtent * (2.0 * a / (grid - 1) - 1); }

/// A: coefficients from values at the regular samples, along one axis.
Eigen::MatrixXd inverse_of_samples(int grid) {
  Eigen::MatrixXd basis(grid, grid);
  for (int r = 0; r < grid; ++r) {
    std::array<double, kMostGrid> n;
    bspline::values(grid, sample_place(grid, r), n.data());
    for (int c = 0; c < grid; ++c) basis(r, c) = n[static_cast<std::size_t>(c)];
  }
  return basis.inverse();
}

const Eigen::MatrixXd& sample_inverse(int grid) {
  static const std::array<Eigen::MatrixXd, kMostGrid + 1> kInverses = [] {
    std::array<Eigen::MatrixXd, kMostGrid + 1> all;
    for (int g = 3; g <= kMostGrid; ++g) all[static_cast<std::size_t>(g)] = inverse_of_samples(g);
    return all;
  }();
  return kInverses[static_cast<std::size_t>(grid)];
}

}  // namespace

Frame frame_about(const Vec3& n) {
  const double s = std::copysign(1.0, n.z()), a = -1 / (s + n.z()), b = n.x() * n.y() * a;
  return {{1 + s * n.x() * n.x() * a, s * b, -s * n.x()}, {b, s + n.y() * n.y() * a, -n.y()}, n};
}

std::size_t PointSet::coefficients_per_point() const {
  const auto g = static_cast<std::size_t>(grid);
  return g * g * g;
}

void PointSet::set_position(std::size_t i, const Vec3& p) { x[i] = p.x(), y[i] = p.y(), z[i] = p.z(); }
void PointSet::set_normal(std::size_t i, const Vec3& n) { nx[i] = n.x(), ny[i] = n.y(), nz[i] = n.z(); }
void PointSet::set_border(std::size_t i, const Vec3& b) { bx[i] = b.x(), by[i] = b.y(), bz[i] = b.z(); }

std::span<double> PointSet::coefficients_of(std::size_t i) {
  const std::size_t n = coefficients_per_point();
  return {coefficients.data() + i * n, n};
}

std::span<const double> PointSet::coefficients_of(std::size_t i) const {
  const std::size_t n = coefficients_per_point();
  return {coefficients.data() + i * n, n};
}

void PointSet::resize(std::size_t count) {
  for_arrays(*this, [&](auto& a) { a.resize(count, 0.0); });
  coefficients.resize(count * coefficients_per_point(), 0.0);
}

PointRecord PointSet::record(std::size_t i) const {
  const auto c = coefficients_of(i);
  return {position(i), normal(i), border(i), reach[i], {c.begin(), c.end()}};
}

void PointSet::restore(std::size_t i, const PointRecord& r) {
  set_position(i, r.position);
  set_normal(i, r.normal);
  set_border(i, r.border);
  reach[i] = r.reach;
  std::copy(r.coefficients.begin(), r.coefficients.end(), coefficients_of(i).begin());
}

void PointSet::append(std::span<const PointRecord> records, std::span<const std::size_t> like) {
  const std::size_t before = size();
  resize(before + records.size());
  for (std::size_t k = 0; k < records.size(); ++k) restore(before + k, records[k]);
  if (attributes.empty()) return;
  std::vector<std::size_t> from(before);
  for (std::size_t i = 0; i < before; ++i) from[i] = i;
  from.insert(from.end(), like.begin(), like.end());
  attributes = attributes.gathered(from);
}

void PointSet::keep(std::span<const std::size_t> indices) {
  const std::size_t per_point = coefficients_per_point();
  const auto gather = [&](std::vector<double>& values, std::size_t width) {
    std::vector<double> kept(indices.size() * width);
    for (std::size_t k = 0; k < indices.size(); ++k)
      std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(indices[k] * width), width,
                  kept.begin() + static_cast<std::ptrdiff_t>(k * width));
    values = std::move(kept);
  };
  for_arrays(*this, [&](auto& a) { gather(a, 1); });
  gather(coefficients, per_point);
  if (!attributes.empty()) attributes = attributes.gathered(indices);
}

std::size_t PointSet::bytes() const {
  std::size_t numbers = coefficients.size();
  for_arrays(*this, [&](const auto& a) { numbers += a.size(); });
  return numbers * sizeof(double);
}

std::vector<Vec3> sample_positions(const PointSet& set, std::size_t i) {
  const Frame frame = frame_about(set.normal(i));
  std::vector<Vec3> places;
  places.reserve(set.coefficients_per_point());
  for (int a = 0; a < set.grid; ++a)
    for (int b = 0; b < set.grid; ++b)
      for (int c = 0; c < set.grid; ++c)
        places.push_back(set.position(i) +
                         set.reach[i] * (sample_place(set.grid, a) * frame.u + sample_place(set.grid, b) * frame.v +
                                         sample_place(set.grid, c) * frame.w));
  return places;
}

void set_samples(PointSet& set, std::size_t i, std::span<const double> values) {
  if (values.size() != set.coefficients_per_point())
    throw InvalidInput("point set: a local grid takes " + std::to_string(set.coefficients_per_point()) + " samples, not " +
                       std::to_string(values.size()));
  const Eigen::MatrixXd& inverse = sample_inverse(set.grid);
  const auto g = static_cast<std::size_t>(set.grid);
  std::array<double, kMostGrid * kMostGrid * kMostGrid> from, to;
  std::copy(values.begin(), values.end(), from.begin());
  // One pass an axis: the axis passed over is the slowest of the input and becomes the fastest of the output.
  for (int pass = 0; pass < 3; ++pass) {
    for (std::size_t rest = 0; rest < g * g; ++rest)
      for (std::size_t r = 0; r < g; ++r) {
        double sum = 0;
        for (std::size_t a = 0; a < g; ++a)
          sum += inverse(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(a)) * from[a * g * g + rest];
        to[rest * g + r] = sum;
      }
    std::swap(from, to);
  }
  std::copy_n(from.begin(), values.size(), set.coefficients_of(i).begin());
}

Bounds residual_bounds(const PointSet& set, std::size_t i) {
  const auto c = set.coefficients_of(i);
  Bounds b{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (std::size_t k = 0; k < c.size(); ++k) {
    const double d = c[k] - set.reach[i] * bspline::greville(set.grid, static_cast<int>(k) % set.grid);
    b.least = std::min(b.least, d);
    b.most = std::max(b.most, d);
  }
  return b;
}

points::Cloud to_cloud(const PointSet& set) {
  points::Cloud cloud;
  cloud.attributes = set.attributes;
  std::vector<double> normals;
  cloud.positions.reserve(set.size());
  normals.reserve(3 * set.size());
  for (std::size_t i = 0; i < set.size(); ++i) {
    cloud.positions.push_back(set.position(i));
    normals.insert(normals.end(), {set.nx[i], set.ny[i], set.nz[i]});
  }
  cloud.attributes.set(attribute::kNormal, 3, std::move(normals));
  return cloud;
}

}  // namespace meniscus::pointset
