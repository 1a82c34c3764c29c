#pragma once

#include <meniscus/pointset/stroke.h>

#include <cstdint>
#include <span>
#include <vector>

namespace meniscus::pointset {

/// A change of a field's values: s'(x) = value(x, s(source(x))). Batches; safe to ask from many threads.
class ValueChange {
 public:
  virtual ~ValueChange() = default;
  /// Whether the surface at a point may move.
  virtual bool touches(const Vec3& position, const Vec3& normal) const = 0;
  /// Turns places into those where the old value is read. Default: the same.
  virtual void sources(std::span<Vec3>) const {}
  /// Turns old values, read at the sources, into new ones.
  virtual void values(std::span<const Vec3>, std::span<double>) const {}
  /// About where a point of the surface goes, for changes that move it sideways.
  virtual Vec3 carried(const Vec3& position) const { return position; }
};

/// s − height · w(x).
class Raise : public ValueChange {
 public:
  Raise(const ToolShape& shape, double height) : shape_(shape), height_(height) {}
  bool touches(const Vec3& p, const Vec3&) const override { return shape_.weight(p) > 0; }
  void values(std::span<const Vec3> x, std::span<double> s) const override;

 private:
  const ToolShape& shape_;
  double height_;
};

/// The share w(x) · share of the way to the plane through `place`.
class Flatten : public ValueChange {
 public:
  Flatten(const ToolShape& shape, const Vec3& place, const Vec3& normal, double share)
      : shape_(shape), place_(place), normal_(normal), share_(share) {}
  bool touches(const Vec3& p, const Vec3& n) const override;
  void values(std::span<const Vec3> x, std::span<double> s) const override;

 private:
  const ToolShape& shape_;
  Vec3 place_, normal_;
  double share_;
};

/// Old values from `pinch` · w times farther from the path, raised by height · w².
class Crease : public ValueChange {
 public:
  Crease(const ToolShape& shape, double height, double pinch) : shape_(shape), height_(height), pinch_(pinch) {}
  bool touches(const Vec3& p, const Vec3&) const override { return shape_.weight(p) > 0; }
  void sources(std::span<Vec3> x) const override;
  void values(std::span<const Vec3> x, std::span<double> s) const override;
  Vec3 carried(const Vec3& p) const override;

 private:
  const ToolShape& shape_;
  double height_, pinch_;
};

/// Old values from w(x) · way back.
class Carry : public ValueChange {
 public:
  Carry(const ToolShape& shape, const Vec3& way) : shape_(shape), way_(way) {}
  bool touches(const Vec3& p, const Vec3&) const override { return shape_.weight(p) > 0; }
  void sources(std::span<Vec3> x) const override;
  Vec3 carried(const Vec3& p) const override;

 private:
  const ToolShape& shape_;
  Vec3 way_;
};

/// s − height · w(x) · brightness of the image there, where the surface faces the light.
class Emboss : public ValueChange {
 public:
  Emboss(const ToolShape& shape, const GreyImage& image, const Projection& projection, double height)
      : shape_(shape), image_(image), projection_(projection), height_(height) {}
  bool touches(const Vec3& p, const Vec3& n) const override;
  void values(std::span<const Vec3> x, std::span<double> s) const override;

 private:
  const ToolShape& shape_;
  const GreyImage& image_;
  Projection projection_;
  double height_;
};

/// What a grid's values have changed by since `since` (deviations then).
class GridChange : public ValueChange {
 public:
  GridChange(const SculptGrid& grid, std::span<const float> since);
  bool touches(const Vec3& p, const Vec3&) const override;
  void values(std::span<const Vec3> x, std::span<double> s) const override;

 private:
  const SculptGrid& grid_;
  std::vector<float> change_;
};

}  // namespace meniscus::pointset
