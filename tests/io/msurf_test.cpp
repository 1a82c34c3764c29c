#include <meniscus/io/msurf.h>

#include <meniscus/base/error.h>
#include <meniscus/pointset/local_fit.h>

#include "support.h"

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::io {
namespace {

points::Cloud octahedron(double x) {
  points::Cloud cloud;
  std::vector<double> normals;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0}) {
      const Vec3 n = side * Vec3::Unit(axis);
      cloud.positions.push_back(n + Vec3(x, 0, 0));
      normals.insert(normals.end(), n.data(), n.data() + 3);
    }
  cloud.attributes.set(attribute::kNormal, 3, normals);
  cloud.attributes.set_integers("id", 1, {1, 2, 3, 4, 5, 6});
  cloud.attributes.set("heat", 1, {0.1, 0.2, 0.3, 0.4, 0.5, 0.6});
  return cloud;
}

pointset::Solid sample_solid() {
  pointset::Solid solid;
  solid.operation = pointset::Operation::Difference;
  for (const double x : {0.0, 0.7}) {
    pointset::Solid leaf;
    leaf.set = pointset::fit(octahedron(x), {.neighbours = 4});
    solid.inputs.push_back(leaf);
  }
  return solid;
}

std::string written_bytes(const pointset::Solid& solid) {
  const TemporaryFolder folder;
  write_msurf(folder / "a.msurf", solid);
  return file_content(folder / "a.msurf");
}

TEST(Msurf, ReadsBackEveryBit) {
  const pointset::Solid solid = sample_solid();
  const std::string bytes = written_bytes(solid);
  const pointset::Solid back = read_msurf_bytes({"a.msurf", bytes});
  ASSERT_EQ(back.operation, solid.operation);
  ASSERT_EQ(back.inputs.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    const pointset::PointSet &a = solid.inputs[k].set, &b = back.inputs[k].set;
    EXPECT_EQ(a.grid, b.grid);
    EXPECT_EQ(a.x, b.x);
    EXPECT_EQ(a.nz, b.nz);
    EXPECT_EQ(a.bx, b.bx);
    EXPECT_EQ(a.reach, b.reach);
    EXPECT_EQ(a.coefficients, b.coefficients);
    EXPECT_EQ(difference(a.attributes, b.attributes), "");
  }
  EXPECT_EQ(bytes, written_bytes(back));
}

TEST(Msurf, IsACloudToReadersOfClouds) {
  const std::string bytes = written_bytes(sample_solid().inputs[0]);
  const Geometry g = read_geometry_bytes("a.msurf", bytes);
  EXPECT_EQ(g.kind, Geometry::Kind::Cloud);
  EXPECT_EQ(g.cloud.positions, octahedron(0).positions);
  EXPECT_EQ(read_geometry_bytes("-", bytes).cloud.size(), 6u);  // known by its first bytes
}

/// A typed error or a sound solid, whatever the bytes.
void expect_sound_or_typed(const std::string& bytes, const std::string& what) {
  try {
    const pointset::Solid solid = read_msurf_bytes({"a.msurf", bytes});
    for (const pointset::Solid& s : solid.operation ? solid.inputs : std::vector<pointset::Solid>{solid})
      for (const double c : s.set.coefficients) ASSERT_TRUE(std::isfinite(c)) << what;
  } catch (const IoError& e) {
    ASSERT_EQ(e.path(), "a.msurf");
  } catch (const std::exception& e) {
    FAIL() << what << ": " << e.what();
  }
}

TEST(Msurf, EveryPrefixAndEveryByteChanged) {
  const std::string good = written_bytes(sample_solid());
  for (std::size_t n = 0; n < good.size(); ++n) {
    EXPECT_THROW(read_msurf_bytes({"a.msurf", std::string_view(good).substr(0, n)}), IoError) << n;
    for (const int change : {1, -1, 256, 511}) {
      std::string bytes = good;
      bytes[n] = static_cast<char>(change > 1 ? change - 256 : bytes[n] + change);
      expect_sound_or_typed(bytes, "byte " + std::to_string(n));
    }
  }
  EXPECT_THROW(read_msurf_bytes({"a.msurf", good + "x"}), IoError);
}

TEST(Msurf, CountsAreCheckedBeforeAllocating) {
  std::string bytes = written_bytes(sample_solid().inputs[0]);
  const std::size_t at = 8 + 4 + 4 + 4;  // mark, version, kind, grid; then the number of points
  for (const unsigned char top : {0x00, 0x10, 0x7f, 0xff}) {
    for (std::size_t k = 0; k < 8; ++k) bytes[at + k] = static_cast<char>(k < 6 ? 0xff : top);
    EXPECT_THROW(read_msurf_bytes({"a.msurf", bytes}), IoError);
  }
}

TEST(Msurf, NestingIsBounded) {
  std::string bytes("msurf\r\n\x1a\1\0\0\0", 12);
  for (int i = 0; i < 100'000; ++i) bytes += std::string("\1\0\0\0", 4);
  EXPECT_THROW(read_msurf_bytes({"a.msurf", bytes}), IoError);
}

TEST(Msurf, RefusesToWriteWhatDoesNotFitTogether) {
  const TemporaryFolder folder;
  pointset::Solid solid = sample_solid();
  solid.inputs[0].set.reach.pop_back();
  EXPECT_THROW(write_msurf(folder / "a.msurf", solid), InvalidInput);
  solid = sample_solid();
  solid.inputs.pop_back();
  EXPECT_THROW(write_msurf(folder / "a.msurf", solid), InvalidInput);
  solid = sample_solid();
  solid.inputs[1].set.coefficients[5] = std::nan("");
  EXPECT_THROW(write_msurf(folder / "a.msurf", solid), InvalidInput);
}

}  // namespace
}  // namespace meniscus::io
