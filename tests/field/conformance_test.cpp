#include "field/conformance.h"

#include <meniscus/field/blobs.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/expression.h>
#include <meniscus/field/grid_field.h>
#include <meniscus/field/primitives.h>
#include <meniscus/field/transform.h>

namespace meniscus::field {
namespace {

using conformance::Case;
using conformance::sway;

std::vector<Blob> some_blobs(std::size_t n, double radius) {
  std::vector<Blob> items;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 c = conformance::random_point(1000 + i, 1.5);
    Blob b{{c.x(), c.y(), c.z()}, Number::named("r", radius), i % 7 == 3 ? -0.5 : 1.0};
    if (i % 3 == 1) b.center[0] = sway(c.x(), 0.4);
    if (i % 3 == 2) b.radius = sway(radius * (1 + static_cast<double>(i % 4)), 0.1 * radius);
    if (i % 5 == 4) b.weight = sway(1, 0.3);
    items.push_back(b);
  }
  return items;
}

std::vector<SegmentBlob> some_segments(std::size_t n, double radius) {
  std::vector<SegmentBlob> items;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 a = conformance::random_point(2000 + i, 1.5), b = conformance::random_point(3000 + i, 1.5);
    items.push_back({{a.x(), sway(a.y(), 0.3), a.z()}, {b.x(), b.y(), sway(b.z(), 0.2)}, radius, 1});
  }
  return items;
}

std::unique_ptr<Field> some_particles() {
  std::vector<Vec3> p, v;
  for (std::size_t i = 0; i < 300; ++i) {
    p.push_back(conformance::random_point(4000 + i, 1.5));
    v.push_back(Vec3::Zero());
  }
  const double radius[] = {0.2};
  return particles(p, radius, v);
}

/// A sampled sphere whose bricks fill [-2, 2)³.
std::unique_ptr<Field> sampled_sphere(Interpolation interpolation) {
  const double voxel = 0.25;
  std::vector<Coord> bricks;
  std::vector<float> values;
  for (int b = 0; b < 8; ++b) {
    const Coord at{b / 4 - 1, b / 2 % 2 - 1, b % 2 - 1};
    bricks.push_back(at);
    for (int v = 0; v < 512; ++v) {
      const Vec3 x = voxel * Vec3(8 * at[0] + v / 64, 8 * at[1] + v / 8 % 8, 8 * at[2] + v % 8);
      values.push_back(static_cast<float>(std::clamp(x.norm() - 1.1, -0.75, 0.75)));
    }
  }
  const auto grid = std::make_shared<const Grid>(voxel, Vec3::Zero(), 0.75, std::move(bricks), std::move(values));
  return std::make_unique<GridField>(grid, interpolation);
}

template <class... F>
Inputs inputs(F... fields) {
  Inputs list;
  (list.push_back(std::move(fields)), ...);
  return list;
}

std::unique_ptr<Field> ball(double x, double y, const Number& r) { return sphere({x, sway(y, 0.3), 0}, r); }

std::unique_ptr<Field> row_of_balls() {
  Inputs list;
  for (int i = 0; i < 9; ++i) list.push_back(ball(0.4 * i - 1.6, 0.1 * i, Number::named("r", 0.35)));
  return blend(std::move(list), sway(0.5, 0.1));
}

const Case kCases[] = {
    {"sphere",
     [] {
       return sphere({0.1, sway(-0.2, 0.5), 0.3}, 0.9);
     }},
    {"box",
     [] {
       return box({0.1, 0.2, sway(0, 0.3)}, {1.2, Number::named("s", 0.8), Number::named("s", 0.8)});
     }},
    {"torus",
     [] {
       return torus({0, 0.1, 0}, {0.3, sway(1, 0.2), 0.2}, 1.0, 0.3);
     }},
    {"capsule",
     [] {
       return capsule({-0.7, 0, 0.1}, {0.8, sway(0.3, 0.4), 0}, 0.4);
     }},
    {"plane",
     [] {
       return plane({0.1, 0.2, sway(0.3, 1)}, {1, sway(2, 0.5), 0.5});
     }},
    {"ellipsoid",
     [] {
       return ellipsoid({0.1, 0, 0}, {0.7, sway(1.1, 0.3), 0.5});
     }},
    {"few gaussian blobs", [] { return blobs(BlobKernel::Gaussian, 0.35, some_blobs(8, 0.5)); }},
    {"many gaussian blobs", [] { return blobs(BlobKernel::Gaussian, sway(0.35, 0.1), some_blobs(60, 0.25)); }},
    {"few compact blobs", [] { return blobs(BlobKernel::Compact, 0.4, some_blobs(8, 0.9)); }},
    {"many compact blobs", [] { return blobs(BlobKernel::Compact, 0.4, some_blobs(200, 0.3)); }},
    {"gaussian segments", [] { return segments(BlobKernel::Gaussian, 0.4, some_segments(6, 0.4)); }},
    {"compact segments", [] { return segments(BlobKernel::Compact, 0.3, some_segments(60, 0.5)); }},
    {"no blobs", [] { return blobs(BlobKernel::Compact, 0.4, {}); }},
    {"particles", some_particles},
    {"trilinear grid", [] { return sampled_sphere(Interpolation::Trilinear); }},
    {"expression",
     [] {
       return std::make_unique<Expression>(
           "sin(2*x)*cos(a*y) + sin(2*y)*cos(a*z) + sin(2*z)*cos(a*x) - c + 0.1*sin(t)*x^2*exp(b*y)",
           std::vector<std::pair<std::string, Number>>{{"a", 2.0}, {"b", Number::named("b", 0.3)}, {"c", sway(0.1, 0.2)}});
     }},
    {"cubic grid", [] { return sampled_sphere(Interpolation::Cubic); }},
    {"union", [] { return set_union(inputs(ball(-0.5, 0, 0.8), ball(0.6, 0.2, 0.7))); }},
    {"intersection",
     [] {
       return set_intersection(inputs(ball(-0.3, 0, 0.9), ball(0.4, 0.2, 0.8), box({0, 0, 0}, {1, 2, 1})));
     }},
    {"difference", [] { return set_difference(inputs(ball(0, 0, 1.2), ball(0.6, 0.2, 0.7), ball(-0.6, 0.2, 0.4))); }},
    {"blend", [] { return blend(inputs(ball(-0.5, 0, 0.7), ball(0.6, 0.2, 0.6)), 0.6); }},
    {"many blended", row_of_balls},
    {"offset", [] { return offset(ball(0, 0, 0.7), sway(0.3, 0.2)); }},
    {"shell",
     [] {
       return shell(torus({0, 0, 0}, {0, 1, 0}, 1, 0.4), 0.2);
     }},
    {"transform",
     [] {
       return transform(box({0.2, 0, 0}, {1, 0.6, 0.8}), {0.1, sway(0.2, 1), 0}, {20, sway(30, 90), 40}, sway(1.3, 0.2));
     }},
    {"transformed blend",
     [] {
       return transform(blend(inputs(ball(-0.5, 0, 0.7), ball(0.6, 0.2, 0.6)), 0.6), {0, 0, 0.1}, {0, 0, sway(0, 60)}, 0.8);
     }},
};

class Conformance : public testing::TestWithParam<Case> {};

TEST_P(Conformance, DerivativesMatchDifferences) { conformance::derivatives_match_differences(GetParam()); }
TEST_P(Conformance, OrdersAgree) { conformance::orders_agree(GetParam()); }
TEST_P(Conformance, BatchEqualsSingle) { conformance::batch_equals_single(GetParam()); }
TEST_P(Conformance, RangeBoundsValues) { conformance::range_bounds_values(GetParam()); }
TEST_P(Conformance, InsideLiesWithinBounds) { conformance::inside_lies_within_bounds(GetParam()); }
TEST_P(Conformance, ParameterRowsMatchDifferences) { conformance::parameter_rows_match_differences(GetParam()); }
TEST_P(Conformance, RatesGiveTimeDerivative) { conformance::rates_give_time_derivative(GetParam()); }
TEST_P(Conformance, SurvivesNastyPoints) { conformance::survives_nasty_points(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Fields, Conformance, testing::ValuesIn(kCases), [](const auto& param) {
  std::string name = param.param.name;
  for (char& ch : name)
    if (ch == ' ') ch = '_';
  return name;
});

}  // namespace
}  // namespace meniscus::field
