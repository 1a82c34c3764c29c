#include <meniscus/sample/surface_cell.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace meniscus::sample {
namespace {

constexpr double kNear = 1.3;   // of the limit: neighbours that are looked at first,
constexpr double kReach = 2.9;  // and at all

}  // namespace

void tangent_frame(const Vec3& n, Vec3& u, Vec3& v) {
  u = n.unitOrthogonal();
  v = n.cross(u);
}

void SurfaceCell::build(const SurfacePoints& points, std::size_t i, std::span<const std::uint32_t> neighbours, double limit,
                        const Box& box) {
  center_ = points.position(i);
  const Vec3 n = points.normal(i);
  tangent_frame(n, axis_u_, axis_v_);
  corner_[0] = {-limit, -limit, kOpen};
  corner_[1] = {limit, -limit, kOpen};
  corner_[2] = {limit, limit, kOpen};
  corner_[3] = {-limit, limit, kOpen};
  count_ = 4;
  nearest_ = std::numeric_limits<double>::infinity();

  // Nearest first, until none farther can reach the cell. Most cells are done with the nearer half.
  const double near = kNear * limit;
  take(points, i, neighbours, 0, near);
  if (4 * farthest2() > near * near) take(points, i, neighbours, near, kReach * limit);
  cut_box(box, limit);
}

/// Cuts with the neighbours on this sheet whose chords are in [from, to), unrolled: same direction, length of the arc.
void SurfaceCell::take(const SurfacePoints& points, std::size_t i, std::span<const std::uint32_t> neighbours, double from,
                       double to) {
  const Vec3 n = points.normal(i);
  candidates_.clear();
  for (const std::uint32_t j : neighbours) {
    const Vec3 d = points.position(j) - center_;
    const double chord2 = d.squaredNorm();
    if (chord2 < from * from || chord2 >= to * to || same_sheet(points, i, j) < 0.5) continue;
    const Vec3 turn = points.normal(j) - n;
    const double arc = std::sqrt(chord2) * arc_over_chord(d, n, points.normal(j));
    nearest_ = std::min(nearest_, arc);
    // The geodesic's start direction, to third order d less its fall times the turn of the normal, and its length.
    const Vec3 unrolled = d - d.dot(n) / 3 * turn;
    const double u = unrolled.dot(axis_u_), v = unrolled.dot(axis_v_), flat = std::sqrt(u * u + v * v);
    if (flat > 0) candidates_.push_back({arc, u * (arc / flat), v * (arc / flat), j});
  }
  std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
    return a.distance < b.distance || (a.distance == b.distance && a.index < b.index);
  });
  for (const Candidate& c : candidates_) {
    if (c.distance * c.distance > 4 * farthest2()) break;
    cut(c.u, c.v, 0.5 * c.distance * c.distance, c.index);
  }
}

/// Keeps the part with (u, v)·p <= offset.
void SurfaceCell::cut(double u, double v, double offset, std::int64_t side) {
  std::array<double, kMaxCorners> above;
  bool crossed = false;
  for (int k = 0; k < count_; ++k) {
    const Corner& a = corner_[static_cast<std::size_t>(k)];
    above[static_cast<std::size_t>(k)] = u * a.u + v * a.v - offset;
    crossed = crossed || above[static_cast<std::size_t>(k)] > 0;
  }
  if (!crossed) return;
  std::array<Corner, kMaxCorners> kept;
  int n = 0;
  for (int k = 0; k < count_; ++k) {
    const auto here = static_cast<std::size_t>(k), next = static_cast<std::size_t>(k + 1 == count_ ? 0 : k + 1);
    const Corner &a = corner_[here], &b = corner_[next];
    const double fa = above[here], fb = above[next];
    if (n + 2 > kMaxCorners) return;
    if (fa <= 0) kept[static_cast<std::size_t>(n++)] = a;
    if ((fa <= 0) == (fb <= 0)) continue;
    const double t = fa / (fa - fb);
    kept[static_cast<std::size_t>(n++)] = {a.u + t * (b.u - a.u), a.v + t * (b.v - a.v), fa <= 0 ? side : a.side};
  }
  if (n < 3) return;
  std::copy_n(kept.begin(), n, corner_.begin());
  count_ = n;
}

void SurfaceCell::cut_box(const Box& box, double limit) {
  share_ = 1;
  for (int a = 0; a < 3; ++a) {
    const double above = std::max(0.0, box.max[a] - center_[a]), below = std::max(0.0, center_[a] - box.min[a]);
    if (above <= 1e-9 * limit || below <= 1e-9 * limit) share_ *= 0.5;
    if (above < 1.5 * limit) cut(axis_u_[a], axis_v_[a], above, kBorder);
    if (below < 1.5 * limit) cut(-axis_u_[a], -axis_v_[a], below, kBorder);
  }
}

double SurfaceCell::area() const {
  double twice = 0;
  for (int k = 0; k < count_; ++k) {
    const Corner& a = corner_[static_cast<std::size_t>(k)];
    const Corner& b = corner_[static_cast<std::size_t>(k + 1 == count_ ? 0 : k + 1)];
    twice += a.u * b.v - a.v * b.u;
  }
  return 0.5 * twice;
}

bool SurfaceCell::open() const {
  return std::any_of(corner_.begin(), corner_.begin() + count_, [](const Corner& c) { return c.side == kOpen; });
}

double SurfaceCell::farthest2() const {
  double r2 = 0;
  for (int k = 0; k < count_; ++k) {
    const Corner& c = corner_[static_cast<std::size_t>(k)];
    r2 = std::max(r2, c.u * c.u + c.v * c.v);
  }
  return r2;
}

double SurfaceCell::farthest() const { return std::sqrt(farthest2()); }

Vec3 SurfaceCell::farthest_corner() const {
  const auto longer = [](const Corner& a, const Corner& b) { return a.u * a.u + a.v * a.v < b.u * b.u + b.v * b.v; };
  const Corner& c = *std::max_element(corner_.begin(), corner_.begin() + count_, longer);
  return center_ + c.u * axis_u_ + c.v * axis_v_;
}

Vec3 SurfaceCell::corner(int k) const {
  const Corner& c = corner_[static_cast<std::size_t>(k)];
  return center_ + c.u * axis_u_ + c.v * axis_v_;
}

}  // namespace meniscus::sample
