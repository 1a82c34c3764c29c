#include <meniscus/scene/inherit.h>

#include <gtest/gtest.h>

namespace meniscus::scene {
namespace {

TEST(Inherited, KeepsWhatIsKeptAndInterpolatesTheRest) {
  // Two triangles of a square in the plane z = 0, with a linear attribute.
  mesh::Mesh old;
  old.positions = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
  old.triangles = {{0, 1, 2}, {0, 2, 3}};
  std::vector<double> linear;
  for (const Vec3& p : old.positions) linear.insert(linear.end(), {p.x(), p.y(), 1 + p.x() - 3 * p.y()});
  old.attributes.set("Cd", 3, linear);
  old.attributes.set_integers("id", 1, {10, 11, 12, 13});
  const std::vector<std::int32_t> kept{1, 3};
  const std::vector<Vec3> positions{{2, 0, 0}, {0, 2, 0}, {0.9, 0.3, 0.2}, {0.2, 1.9, 0}, {-1, -1, 0}};
  const Attributes a = inherited(old, kept, positions);
  const auto values = a.values("Cd", 3);
  ASSERT_EQ(values.size(), 15u);
  const Vec3 places[] = {{2, 0, 0}, {0, 2, 0}, {0.9, 0.3, 0}, {0.2, 1.9, 0}, {0, 0, 0}};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(values[3 * i], places[i].x(), 1e-14);
    EXPECT_NEAR(values[3 * i + 1], places[i].y(), 1e-14);
    EXPECT_NEAR(values[3 * i + 2], 1 + places[i].x() - 3 * places[i].y(), 1e-14);
  }
  const auto ids = a.integers("id");
  EXPECT_EQ(std::vector<std::int64_t>(ids.begin(), ids.end()), (std::vector<std::int64_t>{11, 13, 10, 13, 10}));
}

}  // namespace
}  // namespace meniscus::scene
