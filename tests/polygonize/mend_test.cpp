#include <meniscus/field/combine.h>
#include <meniscus/field/primitives.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/mend.h>
#include <meniscus/polygonize/polygonize.h>

#include <gtest/gtest.h>

#include <algorithm>

namespace meniscus::polygonize {
namespace {

/// Balls of radius `scale` at these places along x, blended.
std::unique_ptr<field::Field> balls(const std::vector<double>& places, double scale = 1) {
  std::vector<std::unique_ptr<field::Field>> parts;
  for (const double x : places) parts.push_back(field::sphere({scale * x, 0.0, 0.0}, scale));
  return field::blend(std::move(parts), 0.4 * scale);
}

mesh::Mesh surface(const field::Field& f, double voxel) { return polygonize(f, {.voxel = voxel}).mesh; }

/// Checks what every mended mesh promises, and returns the share of the old vertices that it kept.
double checked(const mesh::Mesh& old, const mesh::Mesh& fresh, const Mended& mended) {
  const mesh::Audit audit = mesh::validate(mended.mesh);
  const mesh::Audit wanted = mesh::validate(fresh);
  EXPECT_TRUE(audit.good()) << mesh::summary(audit);
  EXPECT_EQ(audit.components, wanted.components);
  EXPECT_EQ(audit.euler, wanted.euler);
  EXPECT_TRUE(std::is_sorted(mended.kept_vertices.begin(), mended.kept_vertices.end()));
  for (std::size_t i = 0; i < mended.kept_vertices.size(); ++i)
    EXPECT_EQ(mended.mesh.positions[i], old.positions[static_cast<std::size_t>(mended.kept_vertices[i])]);
  for (std::size_t f = 0; f < mended.kept_triangles.size(); ++f) {
    const Triangle& before = old.triangles[static_cast<std::size_t>(mended.kept_triangles[f])];
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(mended.kept_vertices[static_cast<std::size_t>(mended.mesh.triangles[f][k])], before[k]);
  }
  // Whatever was not kept lies in the regions told.
  std::vector<std::uint8_t> kept(old.positions.size());
  for (const std::int32_t i : mended.kept_vertices) kept[static_cast<std::size_t>(i)] = 1;
  for (std::size_t i = 0; i < kept.size(); ++i)
    EXPECT_TRUE(kept[i] != 0 || std::any_of(mended.regions.begin(), mended.regions.end(),
                                            [&](const Box& b) { return b.contains(old.positions[i]); }));
  return static_cast<double>(mended.kept_vertices.size()) / static_cast<double>(old.positions.size());
}

TEST(Mend, JoinsTwoBallsWhereTheyMeetAndKeepsTheRest) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    const mesh::Mesh old = surface(*balls({-1.3, 1.3}, scale), 0.1 * scale);
    const auto after = balls({-1.0, 1.0}, scale);
    // The old vertices where the new balls are: as if carried there.
    mesh::Mesh carried = old;
    for (Vec3& p : carried.positions) p.x() += (p.x() < 0 ? 0.3 : -0.3) * scale;
    const mesh::Mesh fresh = surface(*after, 0.1 * scale);
    const Mended mended = mend(carried, {}, fresh, 0.1 * scale);
    EXPECT_FALSE(mended.whole);
    EXPECT_EQ(mended.regions.size(), 1u);
    EXPECT_GT(checked(carried, fresh, mended), 0.7);
    EXPECT_EQ(mesh::validate(mended.mesh).components, 1u);
  }
}

TEST(Mend, PartsAndClosesThem) {
  const mesh::Mesh old = surface(*balls({-1.0, 1.0}), 0.1);
  const mesh::Mesh fresh = surface(*balls({-1.05, 1.3}), 0.1);
  mesh::Mesh carried = old;
  for (Vec3& p : carried.positions) p.x() += p.x() < 0 ? -0.05 : 0.3;
  const Mended mended = mend(carried, {}, fresh, 0.1);
  EXPECT_FALSE(mended.whole);
  EXPECT_GT(checked(carried, fresh, mended), 0.7);
  EXPECT_EQ(mesh::validate(mended.mesh).components, 2u);
}

TEST(Mend, LetsPiecesBeBornAndDie) {
  const mesh::Mesh two = surface(*balls({-2, 2}), 0.15);
  const mesh::Mesh one = surface(*balls({-2}), 0.15);
  const Mended born = mend(one, {}, two, 0.15);
  EXPECT_EQ(checked(one, two, born), 1);
  const Mended died = mend(two, {}, one, 0.15);
  EXPECT_EQ(died.kept_vertices.size(), one.positions.size());
  checked(two, one, died);
}

TEST(Mend, ReplacesAboutLostVerticesOnly) {
  const mesh::Mesh old = surface(*balls({0}), 0.1);
  std::vector<std::uint8_t> lost(old.positions.size());
  lost[123] = 1;
  const Mended mended = mend(old, lost, old, 0.1);
  const double share = checked(old, old, mended);
  EXPECT_GT(share, 0.95);
  EXPECT_LT(share, 1);
  ASSERT_EQ(mended.regions.size(), 1u);
  EXPECT_LT(mended.regions[0].diameter(), 1.5);
}

TEST(Mend, ReplacesFoldsAndLeavesASoundMeshAlone) {
  const mesh::Mesh fresh = surface(*balls({0}), 0.1);
  EXPECT_EQ(checked(fresh, fresh, mend(fresh, {}, fresh, 0.1)), 1);
  mesh::Mesh folded = fresh;
  const Triangle t = folded.triangles[500];
  std::swap(folded.positions[static_cast<std::size_t>(t[0])], folded.positions[static_cast<std::size_t>(t[1])]);
  const Mended mended = mend(folded, {}, fresh, 0.1);
  EXPECT_FALSE(mended.whole);
  EXPECT_GT(checked(folded, fresh, mended), 0.9);
}

TEST(Mend, TakesTheFreshMeshWholeWhereNothingFits) {
  const mesh::Mesh old = surface(*balls({-5}), 0.2);
  const mesh::Mesh fresh = surface(*balls({5}), 0.2);
  const Mended mended = mend(old, {}, fresh, 0.2);
  EXPECT_TRUE(mended.whole);
  EXPECT_EQ(mended.mesh.positions, fresh.positions);
  EXPECT_TRUE(mend({}, {}, fresh, 0.2).whole);
  EXPECT_TRUE(mend(old, {}, {}, 0.2).mesh.triangles.empty());
}

TEST(Mend, IsTheSameForAnyNumberOfThreads) {
  mesh::Mesh old = surface(*balls({-1.3, 1.3}), 0.12);
  for (Vec3& p : old.positions) p.x() += p.x() < 0 ? 0.3 : -0.3;
  const mesh::Mesh fresh = surface(*balls({-1.0, 1.0}), 0.12);
  const Mended first = mend(old, {}, fresh, 0.12);
  for (const int threads : {1, 2, 3, 5, 8}) {
    RunControl run(RunOptions{.threads = threads, .seed = 0, .on_progress = {}});
    run.execute([&] {
      const Mended again = mend(old, {}, fresh, 0.12, run);
      EXPECT_EQ(again.mesh.positions, first.mesh.positions);
      EXPECT_EQ(again.mesh.triangles, first.mesh.triangles);
    });
  }
}

}  // namespace
}  // namespace meniscus::polygonize
