#pragma once

#include <meniscus/base/vec.h>

#include <cstddef>
#include <vector>

namespace meniscus::field {

/// Points to evaluate, structure of arrays: three arrays of `size` coordinates in world units.
struct Positions {
  const double* x = nullptr;
  const double* y = nullptr;
  const double* z = nullptr;
  std::size_t size = 0;

  Vec3 operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
  Positions part(std::size_t begin, std::size_t count) const { return {x + begin, y + begin, z + begin, count}; }
};

/// Which derivatives are wanted. Each costs more than the one before.
enum class Order {
  Value,         ///< F
  Gradient,      ///< F, ∇F
  GradientTime,  ///< F, ∇F, F_t: what moving particles need
  Hessian,       ///< F, ∇F, H: curvature
  HessianTime,   ///< F, ∇F, F_t, H, ∇F_t: what the surface's velocity needs (14 numbers)
};

constexpr bool has_gradient(Order o) { return o != Order::Value; }
constexpr bool has_hessian(Order o) { return o == Order::Hessian || o == Order::HessianTime; }
constexpr bool has_time(Order o) { return o == Order::GradientTime || o == Order::HessianTime; }

/// Rows of a jet array, one array over all points per derivative. Hessian rows are xx, xy, xz, yy, yz, zz.
enum JetRow : std::size_t { kF, kFx, kFy, kFz, kFt, kFxx, kFxy, kFxz, kFyy, kFyz, kFzz, kFxt, kFyt, kFzt };

/// Rows that an array for `order` holds (rows of derivatives that were not asked for are there but untouched).
constexpr std::size_t row_count(Order order) {
  switch (order) {
    case Order::Value: return 1;
    case Order::Gradient: return 4;
    case Order::GradientTime: return 5;
    case Order::Hessian: return 11;
    case Order::HessianTime: return 14;
  }
  return 0;
}

/// Where results go: row r of point i is rows[r * stride + i]. A view; does not own.
struct JetView {
  double* rows = nullptr;
  std::size_t stride = 0;
  std::size_t size = 0;
  Order order = Order::Value;

  double* row(std::size_t r) const { return rows + r * stride; }
  JetView part(std::size_t begin, std::size_t count) const { return {rows + begin, stride, count, order}; }

  double value(std::size_t i) const { return rows[i]; }
  Vec3 gradient(std::size_t i) const { return {row(kFx)[i], row(kFy)[i], row(kFz)[i]}; }
  double time(std::size_t i) const { return row(kFt)[i]; }
  Mat3 hessian(std::size_t i) const {
    Mat3 h;
    h << row(kFxx)[i], row(kFxy)[i], row(kFxz)[i], row(kFxy)[i], row(kFyy)[i], row(kFyz)[i], row(kFxz)[i], row(kFyz)[i],
        row(kFzz)[i];
    return h;
  }
  Vec3 gradient_time(std::size_t i) const { return {row(kFxt)[i], row(kFyt)[i], row(kFzt)[i]}; }
};

/// An owned array of jets.
class JetBatch {
 public:
  JetBatch(std::size_t size, Order order) : size_(size), order_(order), data_(size * row_count(order)) {}
  JetView view() { return {data_.data(), size_, size_, order_}; }
  std::size_t size() const { return size_; }
  Order order() const { return order_; }

  double value(std::size_t i) const { return data_[i]; }
  Vec3 gradient(std::size_t i) const { return reader().gradient(i); }
  Mat3 hessian(std::size_t i) const { return reader().hessian(i); }
  double time(std::size_t i) const { return reader().time(i); }
  Vec3 gradient_time(std::size_t i) const { return reader().gradient_time(i); }

 private:
  JetView reader() const { return {const_cast<double*>(data_.data()), size_, size_, order_}; }
  std::size_t size_;
  Order order_;
  std::vector<double> data_;
};

/// Positions that own their arrays.
class PositionBatch {
 public:
  PositionBatch() = default;
  explicit PositionBatch(std::size_t size) : x(size), y(size), z(size) {}
  explicit PositionBatch(const std::vector<Vec3>& points) : PositionBatch(points.size()) {
    for (std::size_t i = 0; i < points.size(); ++i) set(i, points[i]);
  }
  void set(std::size_t i, const Vec3& p) {
    x[i] = p.x();
    y[i] = p.y();
    z[i] = p.z();
  }
  Positions view() const { return {x.data(), y.data(), z.data(), x.size()}; }

  std::vector<double> x, y, z;
};

}  // namespace meniscus::field
