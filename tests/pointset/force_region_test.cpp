#include <meniscus/pointset/force_region.h>

#include <meniscus/pointset/local_fit.h>

#include "clouds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace meniscus::pointset {
namespace {

Stroke pull() {
  Stroke s;
  s.path = {Vec3(0, 0, 1)};
  s.radius = 0.4;
  s.strength = 0.1;
  s.voxels = 24;
  return s;
}

double most(std::span<const float> values) {
  double largest = 0;
  for (const float v : values) largest = std::max(largest, std::abs(static_cast<double>(v)));
  return largest;
}

TEST(ForceRegion, ValuesChangeByTheStrengthWhateverTheMaterial) {
  const PointSetField field(fit(test::sphere(2000)));
  for (const Material& material : {Material{}, Material{5, 0, 0}, Material{1, 100, 300}}) {
    Stroke s = pull();
    s.material = material;
    ForceRegion region(field, s, ToolShape(s), 8, {});
    EXPECT_EQ(most(region.grid().deviation()), 0);
    for (int k = 0; k < 8; ++k) region.grid().step(s.seconds / 8);
    EXPECT_NEAR(most(region.grid().deviation()), 0.1, 2e-3);
    const auto& d = region.grid().deviation();
    EXPECT_LE(*std::max_element(d.begin(), d.end()), 1e-4) << "outwards lowers values";
  }
}

TEST(ForceRegion, AgreesWithTheFieldWhateverHasMoved) {
  const PointSetField field(fit(test::sphere(2000)));
  const Stroke s = pull();
  ForceRegion region(field, s, ToolShape(s), 8, {});
  region.grid().step(0.1);
  region.sample(field, {});
  const SculptGrid& grid = region.grid();
  const auto cell = grid.cell(Vec3(0.03, 0.05, 1.02));
  EXPECT_NEAR(grid.at(cell, grid.value()), field::value_at(field, Vec3(0.03, 0.05, 1.02)), 1e-3);
  EXPECT_GT(most(grid.deviation()), 1e-3);
}

TEST(ForceRegion, HoldsWhatIsOutsideTheStrokesRegion) {
  const PointSetField field(fit(test::sphere(2000)));
  Stroke s = pull();
  s.region = Box{Vec3(0, -1, 0), Vec3(1, 1, 2)};
  ForceRegion region(field, s, ToolShape(s), 4, {});
  region.grid().step(0.1);
  for (std::size_t i = 0; i < region.grid().size(); ++i)
    if (region.grid().position(i).x() < 0) EXPECT_EQ(region.grid().deviation()[i], 0);
  EXPECT_GT(most(region.grid().deviation()), 1e-3);
}

}  // namespace
}  // namespace meniscus::pointset
