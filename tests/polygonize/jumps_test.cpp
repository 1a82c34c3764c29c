#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/polygonize.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::polygonize {
namespace {

/// F = z within radius r of the z axis; beyond, ±r by the sign of z: a disc is all that is zero. Positive outside a ball.
class Disc final : public field::Field {
 public:
  explicit Disc(double r) : r_(r) {}
  std::unique_ptr<Field> clone() const override { return std::make_unique<Disc>(*this); }
  field::Interval range(const Box&) const override { return field::Interval::everything(); }
  Box bounds_below(double) const override { return Box::around(Vec3::Zero(), 2 * r_); }
  bool moving() const override { return false; }

 protected:
  void do_evaluate(const field::Positions& x, const field::JetView& out) const override {
    for (std::size_t i = 0; i < x.size; ++i) {
      const Vec3 p = x[i];
      const bool near = std::hypot(p.x(), p.y()) < r_;
      out.rows[i] = p.norm() > 1.7 * r_ ? r_ : near ? p.z() : p.z() < 0 ? -r_ : r_;
      if (!field::has_gradient(out.order)) continue;
      out.row(field::kFx)[i] = out.row(field::kFy)[i] = 0;
      out.row(field::kFz)[i] = 1;
    }
  }

 private:
  double r_;
};

TEST(Jumps, AreLeftOpenOnlyWhenAsked) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    PolygonizeOptions o;
    o.voxel = 0.0731 * scale;
    const auto closed = polygonize(Disc(scale), o);
    EXPECT_TRUE(mesh::validate(closed.mesh).closed());
    EXPECT_EQ(closed.report.triangles_on_jumps, 0u);

    o.open = true;
    const auto open = polygonize(Disc(scale), o);
    EXPECT_EQ(open.mesh.triangles.size() + open.report.triangles_on_jumps, closed.mesh.triangles.size());
    EXPECT_FALSE(mesh::validate(open.mesh).closed());
    EXPECT_TRUE(mesh::validate(open.mesh).manifold());
    EXPECT_EQ(open.report.components, 1u);
    EXPECT_EQ(open.mesh.attributes.values("N", 3).size(), 3 * open.mesh.positions.size());
    for (const Vec3& p : open.mesh.positions) EXPECT_NEAR(p.z(), 0, 1e-9 * scale);
    // All of the disc up to a cell's width, and nothing beyond it.
    const double area = mesh::area(open.mesh) / (scale * scale);
    EXPECT_LE(area, 3.1416);
    EXPECT_GE(area, 3.1416 * 0.85 * 0.85);
  }
}

}  // namespace
}  // namespace meniscus::polygonize
