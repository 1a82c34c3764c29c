#include <meniscus/pointset/value_change.h>

#include <algorithm>
#include <cmath>

namespace meniscus::pointset {
namespace {

// Of the voxel: changes below this leave a point as it is.
constexpr double kNothing = 1e-6;

}  // namespace

void Raise::values(std::span<const Vec3> x, std::span<double> s) const {
  for (std::size_t i = 0; i < x.size(); ++i) s[i] -= height_ * shape_.weight(x[i]);
}

// The other side of a thin body has a plane of its own.
bool Flatten::touches(const Vec3& p, const Vec3& n) const {
  const auto reach = shape_.at(p);
  return reach.weight > 0 && n.dot(normal_.cwiseProduct(reach.signs)) > 0;
}

void Flatten::values(std::span<const Vec3> x, std::span<double> s) const {
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto reach = shape_.at(x[i]);
    const double plane = normal_.dot(x[i].cwiseProduct(reach.signs) - place_);
    s[i] += reach.weight * share_ * (plane - s[i]);
  }
}

void Crease::sources(std::span<Vec3> x) const {
  for (Vec3& p : x) {
    const auto reach = shape_.at(p);
    p += pinch_ * reach.weight * (p - reach.nearest);
  }
}

void Crease::values(std::span<const Vec3> x, std::span<double> s) const {
  for (std::size_t i = 0; i < x.size(); ++i) s[i] -= height_ * std::pow(shape_.weight(x[i]), 2);
}

Vec3 Crease::carried(const Vec3& p) const {
  const auto reach = shape_.at(p);
  const double share = pinch_ * reach.weight;
  return p - share / (1 + share) * (p - reach.nearest);
}

void Carry::sources(std::span<Vec3> x) const {
  for (Vec3& p : x) {
    const auto reach = shape_.at(p);
    p -= reach.weight * way_.cwiseProduct(reach.signs);
  }
}

Vec3 Carry::carried(const Vec3& p) const {
  const auto reach = shape_.at(p);
  return p + reach.weight * way_.cwiseProduct(reach.signs);
}

bool Emboss::touches(const Vec3& p, const Vec3& n) const {
  if (!(n.dot(light(projection_, p)) < 0) || !(shape_.weight(p) > 0)) return false;
  const auto place = image_place(projection_, p);
  return place && place->minCoeff() >= 0 && place->maxCoeff() <= 1;
}

void Emboss::values(std::span<const Vec3> x, std::span<double> s) const {
  for (std::size_t i = 0; i < x.size(); ++i)
    if (const auto place = image_place(projection_, x[i]))
      s[i] -= height_ * shape_.weight(x[i]) * brightness(image_, place->x(), place->y());
}

GridChange::GridChange(const SculptGrid& grid, std::span<const float> since)
    : grid_(grid), change_(grid.deviation().begin(), grid.deviation().end()) {
  for (std::size_t i = 0; i < change_.size(); ++i) change_[i] -= since[i];
}

bool GridChange::touches(const Vec3& p, const Vec3&) const {
  return grid_.bounds().contains(p) && std::abs(grid_.at(grid_.cell(p), change_)) > kNothing * grid_.voxel();
}

void GridChange::values(std::span<const Vec3> x, std::span<double> s) const {
  // Outside the grid the nearest voxel stands for the place: one of the border, which does not change.
  for (std::size_t i = 0; i < x.size(); ++i) s[i] += grid_.at(grid_.cell(x[i]), change_);
}

}  // namespace meniscus::pointset
