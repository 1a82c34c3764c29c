#include "motion/moving_scenes.h"

#include <meniscus/motion/strain_factor.h>
#include <meniscus/motion/velocity.h>

#include <gtest/gtest.h>

#include <limits>

namespace meniscus::motion {
namespace {

struct Case {
  mesh::Mesh mesh;
  std::vector<Strain> list;
};

Case example(double scale) {
  const auto f = test::three_blobs(scale);
  Case c{test::surface(*f, 0.15 * scale), {}};
  const std::vector<Vec3>& x = c.mesh.positions;
  const std::vector<Vec3> n = velocities(*f, x, {}).normal;
  std::vector<std::int32_t> towards(x.size());
  for (const Triangle& t : c.mesh.triangles) towards[static_cast<std::size_t>(t[0])] = t[1];
  c.list = strains(resisting(x, n, c.mesh.triangles), x, n, {}, tangent_frames(x, n, towards), {});
  return c;
}

TEST(StrainFactor, SolvesToSinglePrecision) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const Case c = example(scale);
    const auto size = static_cast<Eigen::Index>(2 * c.mesh.positions.size());
    const double guide = 1e-2;
    StrainFactor factor;
    EXPECT_FALSE(factor.ready());
    factor.analyse(c.mesh.triangles, c.mesh.positions.size());
    ASSERT_TRUE(factor.factorise(c.list, guide));
    Strain::Vector wanted(size);
    for (Eigen::Index i = 0; i < size; ++i) wanted[i] = std::sin(static_cast<double>(i * i));
    Strain::Vector right = Strain::Vector::Zero(size);
    for (const Strain& e : c.list) {
      const Strain::Corners t = e.gather(wanted);
      Strain::Corners held;  // by the guide: the mean stiffness of a vertex's two directions
      for (Eigen::Index k = 0; k < 6; k += 2)
        held.segment<2>(k) = guide * e.weight * e.rows.middleCols<2>(k).squaredNorm() / 2 * t.segment<2>(k);
      e.scatter(e.weight * (e.rows.transpose() * (e.rows * t)), right);
      e.scatter(held, right);
    }
    EXPECT_LT((factor.solve(right) - wanted).norm(), 1e-3 * wanted.norm());
    EXPECT_EQ(factor.solve(Strain::Vector::Zero(size)).norm(), 0);
  }
}

TEST(StrainFactor, RefusesWhatIsNotFinite) {
  Case c = example(1);
  StrainFactor factor;
  factor.analyse(c.mesh.triangles, c.mesh.positions.size());
  c.list[7].rows(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(factor.factorise(c.list, 1e-2));
  EXPECT_FALSE(factor.ready());
}

}  // namespace
}  // namespace meniscus::motion
