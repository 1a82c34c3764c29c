#include <meniscus/polygonize/field_sampler.h>

#include <algorithm>
#include <cstdlib>

namespace meniscus::polygonize {
namespace {

/// One brick's samples while they are gathered.
class BrickSamples {
 public:
  BrickSamples(const Coord& brick, double* values) : brick_(brick), values_(values) {
    unknown_.fill((1U << kBrickPoints) - 1);
  }

  /// Takes over the points shared with another brick that is complete.
  void share(const Coord& other, const double* values) {
    std::array<int, 3> d;
    for (std::size_t a = 0; a < 3; ++a) {
      if (std::abs(other[a] - brick_[a]) > 1) return;
      d[a] = other[a] - brick_[a];
    }
    constexpr int kLast = kBrickPoints - 1;
    const auto first = [&](std::size_t a) { return d[a] > 0 ? kLast : 0; };
    const auto last = [&](std::size_t a) { return d[a] < 0 ? 0 : kLast; };
    const int count = last(2) - first(2) + 1;
    for (int i = first(0); i <= last(0); ++i)
      for (int j = first(1); j <= last(1); ++j) {
        const std::size_t from = number(i - kBrickCells * d[0], j - kBrickCells * d[1], first(2) - kBrickCells * d[2]);
        std::copy_n(values + from, count, values_ + number(i, j, first(2)));
        unknown_[row(i, j)] &= static_cast<std::uint16_t>(~(((1U << count) - 1) << first(2)));
      }
  }

  /// Evaluates the points that are not known yet; returns how many.
  std::size_t complete(const ClippedField& field, const Lattice& lattice) {
    std::array<double, kBrickSamples> x;
    std::array<double, kBrickSamples> y;
    std::array<double, kBrickSamples> z;
    std::array<std::uint16_t, kBrickSamples> place;
    std::size_t count = 0;
    for (int i = 0; i < kBrickPoints; ++i)
      for (int j = 0; j < kBrickPoints; ++j) {
        const Coord base = {brick_[0] * kBrickCells + i, brick_[1] * kBrickCells + j, brick_[2] * kBrickCells};
        for (unsigned bits = unknown_[row(i, j)]; bits != 0; bits &= bits - 1) {
          const int k = __builtin_ctz(bits);
          const Vec3 p = lattice.point({base[0], base[1], base[2] + k});
          x[count] = p.x();
          y[count] = p.y();
          z[count] = p.z();
          place[count++] = static_cast<std::uint16_t>(number(i, j, k));
        }
      }
    if (count == 0) return 0;
    std::array<double, kBrickSamples> f;
    field.evaluate({x.data(), y.data(), z.data(), count}, {f.data(), count, count, field::Order::Value});
    for (std::size_t n = 0; n < count; ++n) values_[place[n]] = f[n];
    return count;
  }

 private:
  static std::size_t row(int i, int j) { return static_cast<std::size_t>(i * kBrickPoints + j); }
  static std::size_t number(int i, int j, int k) {
    return static_cast<std::size_t>((i * kBrickPoints + j) * kBrickPoints + k);
  }

  Coord brick_;
  double* values_;
  std::array<std::uint16_t, kBrickPoints * kBrickPoints> unknown_;  // per row along z, one bit a point
};

}  // namespace

std::size_t FieldSampler::sample(std::span<const Coord> bricks, double* values) const {
  std::size_t evaluated = 0;
  for (std::size_t n = 0; n < bricks.size(); ++n) {
    BrickSamples brick(bricks[n], values + n * kBrickSamples);
    for (std::size_t m = 0; m < n; ++m) brick.share(bricks[m], values + m * kBrickSamples);
    evaluated += brick.complete(field_, lattice_);
  }
  return evaluated;
}

}  // namespace meniscus::polygonize
