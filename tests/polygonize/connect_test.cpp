#include <meniscus/base/random.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/polygonize/connect.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/polygonize/shell.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::polygonize {
namespace {

enum class Noise { Uniform, Signs, WithZeros, Extreme };

/// A random number at every lattice point, from the point alone.
class NoiseSampler : public Sampler {
 public:
  NoiseSampler(std::uint64_t seed, Noise noise, double bias) : seed_(seed), noise_(noise), bias_(bias) {}

  std::size_t sample(std::span<const Coord> bricks, double* values) const override {
    for (const Coord& brick : bricks)
      for (int i = 0; i < kBrickPoints; ++i)
        for (int j = 0; j < kBrickPoints; ++j)
          for (int k = 0; k < kBrickPoints; ++k) *values++ = value({8 * brick[0] + i, 8 * brick[1] + j, 8 * brick[2] + k});
    return bricks.size() * kBrickSamples;
  }

 private:
  double value(const Coord& c) const {
    const auto shifted = [&](std::size_t a) { return static_cast<std::uint64_t>(c[a] + 1000); };
    const std::uint64_t key = (shifted(0) * 2000 + shifted(1)) * 2000 + shifted(2);
    const auto r = random_uniform(seed_, key, 0);
    const double u = r[0] - bias_;
    switch (noise_) {
      case Noise::Uniform: return u;
      case Noise::Signs: return u < 0 ? -1 : 1;  // every face decision is a tie
      case Noise::WithZeros: return r[1] < 0.3 ? 0 : u;
      case Noise::Extreme: {
        constexpr double kInf = std::numeric_limits<double>::infinity();
        constexpr std::array kOdd = {1e-300, 1e300, kInf, -kInf, std::nan(""), 5e-324, 1.0, 0.0};
        return std::copysign(1, u) * kOdd[static_cast<std::size_t>(r[1] * 8)];
      }
    }
    return 0;
  }
  std::uint64_t seed_;
  Noise noise_;
  double bias_;
};

class RandomSigns : public ::testing::TestWithParam<Noise> {};

// The key property: whatever the signs, the mesh is closed, manifold and oriented. Twelve cells an axis, so that faces and
// edges between bricks are part of it; inside fractions from sparse to dense, since each favours other ambiguous cases.
TEST_P(RandomSigns, AlwaysGiveClosedManifoldOrientedMeshes) {
  std::size_t splits = 0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    const double bias = 0.05 + 0.9 * random_uniform(seed, 0, 1)[0];
    const NoiseSampler sampler(seed, GetParam(), bias);
    const Lattice lattice{Vec3(0.1, 0.2, 0.3), 0.7, {-3, -5, 2}, {8, 6, 13}};
    const Shell shell = build_shell(sampler, lattice, {{0, 0, 0}}, {.trilinear = seed % 2 == 0, .max_cells = 1 << 20}, {});
    mesh::Mesh mesh;
    mesh.positions = shell.positions;
    mesh.triangles = connect(shell, 1 << 20, {}).triangles;
    for (const SurfaceCell& c : shell.cells) splits += CellCases::get()[c.kind].split != 0 ? 1 : 0;
    const mesh::Audit audit = mesh::validate(mesh);
    ASSERT_TRUE(audit.closed() && audit.manifold() && audit.oriented() && audit.finite()) << mesh::summary(audit) << seed;
    ASSERT_EQ(audit.repeated_vertices, 0U);
    ASSERT_EQ(audit.unused_vertices, 0U);
    ASSERT_GT(audit.triangles, 0U);
  }
  if (GetParam() == Noise::Uniform) EXPECT_GT(splits, 1000U);  // the case that needs them does occur
}

INSTANTIATE_TEST_SUITE_P(Connect, RandomSigns,
                         ::testing::Values(Noise::Uniform, Noise::Signs, Noise::WithZeros, Noise::Extreme));

// Four inside points in a 2×2×2 checkerboard and its complement, alone in space: all six faces ambiguous.
TEST(Connect, CheckerboardIsClosedEitherWay) {
  for (const int parity : {0, 1}) {
    std::vector<float> values(512, 1);
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j)
        for (int k = 0; k < 8; ++k)
          if ((i + j + k) % 2 == parity) values[field::Grid::number(i, j, k)] = -1;
    const field::Grid grid(1, Vec3::Zero(), 3, {{0, 0, 0}}, values);
    const mesh::Audit audit = mesh::validate(polygonize_grid(grid).mesh);
    EXPECT_TRUE(audit.good()) << mesh::summary(audit);
    EXPECT_EQ(audit.euler, 2 * static_cast<long long>(audit.components));
  }
}

TEST(CellCases, EveryLoopUsesAtLeastThreeEdgesAndEveryCrossedEdgeHasALoop) {
  const CellCases& cases = CellCases::get();
  for (unsigned signs = 0; signs < 256; ++signs) {
    const auto inside = static_cast<std::uint8_t>(signs);
    const unsigned faces = static_cast<unsigned>(__builtin_popcount(cases.ambiguous_faces(inside)));
    for (unsigned joined = 0; joined < 1U << faces; ++joined) {
      const CellCase& cell = cases[cases.index(inside, joined)];
      ASSERT_EQ(cell.inside, inside);
      std::array<int, 4> length{};
      for (int e = 0; e < 12; ++e) {
        const bool crossed = ((inside >> edge_corner(e)) & 1) != ((inside >> edge_end(e)) & 1);
        const std::uint8_t loop = cell.loop_of_edge[static_cast<std::size_t>(e)];
        ASSERT_EQ(crossed, loop != kNoLoop);
        if (crossed) ++length.at(loop);
      }
      for (int l = 0; l < cell.loops; ++l) ASSERT_GE(length.at(static_cast<std::size_t>(l)), 3);
    }
  }
}

}  // namespace
}  // namespace meniscus::polygonize
