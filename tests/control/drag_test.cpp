#include "support/drag_suite.h"

#include <meniscus/base/error.h>
#include <meniscus/control/drag.h>
#include <meniscus/field/blobs.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/expression.h>
#include <meniscus/field/primitives.h>

#include <gtest/gtest.h>

#include <cmath>

namespace meniscus::control {
namespace {

using field::Blob;
using field::BlobKernel;
using field::Field;
using field::Number;
using Outcome = StepReport::Outcome;

std::vector<double> values(const Field& f) {
  std::vector<double> q;
  for (const auto& p : f.parameters()) q.push_back(p.value);
  return q;
}

double value(const Field& f, const std::string& name) {
  for (const auto& p : f.parameters())
    if (p.name == name) return p.value;
  ADD_FAILURE() << "no parameter " << name;
  return 0;
}

std::unique_ptr<Field> ball(double scale = 1) {
  return field::sphere({Number(0.0), Number(0.0), Number(0.0)}, Number(scale));
}

std::unique_ptr<Field> row_of_blobs(int count, double scale = 1, BlobKernel kernel = BlobKernel::Gaussian) {
  std::vector<Blob> items;
  for (int i = 0; i < count; ++i)
    items.push_back({{Number(0.8 * i * scale), Number(0.1 * (i % 3) * scale), Number(0.0)},
                     Number((0.9 + 0.05 * (i % 2)) * scale),
                     Number(1.0)});
  return field::blobs(kernel, Number::frozen(0.3), items);
}

Vec3 on_surface(const Field& f, const Vec3& near, double length) {
  const auto p = nearest_surface_point(f, near, length);
  EXPECT_TRUE(p.has_value());
  return p.value_or(near);
}

TEST(Drag, ThereAndBackRestoresTheShapeAtAnyScale) {
  for (const double scale : {0.01, 1.0, 1000.0})
    for (const BlobKernel kernel : {BlobKernel::Gaussian, BlobKernel::Compact}) {
      const auto f = row_of_blobs(5, scale, kernel);
      const std::vector<double> before = values(*f);
      ControlSession session(*f);
      const Vec3 a = on_surface(*f, Vec3(1.6, 0.7, 0) * scale, scale), b = on_surface(*f, Vec3(0, -0.7, 0.1) * scale, scale);
      const std::size_t dragged = session.add(a).id, pin = session.add(b).id;
      const Vec3 pinned = session.controls()[pin].position;
      for (const Vec3& away : {Vec3(0.1, 0.4, 0), Vec3(-0.1, -0.2, 0.3), Vec3(0, 0.3, -0.3), Vec3(0, 0, 0)}) {
        session.aim(dragged, a + scale * away);
        const StepReport r = session.run();
        ASSERT_EQ(r.outcome, Outcome::Arrived) << scale << ' ' << away.transpose();
        EXPECT_EQ(r.status, Status::Solved);
        EXPECT_EQ(r.rank, 2u);
        EXPECT_LE(std::abs(field::value_at(*f, session.controls()[dragged].position)),
                  1e-8 * (kernel == BlobKernel::Compact ? 4 : 1));
        EXPECT_EQ(session.controls()[pin].position, pinned) << "pins do not move";
        EXPECT_LE(std::abs(field::value_at(*f, b)), 1e-8);
      }
      for (std::size_t k = 0; k < before.size(); ++k) {
        const bool weight = f->parameters()[k].quantity == field::Quantity::Weight;
        EXPECT_NEAR(values(*f)[k], before[k], 1e-9 * (weight ? 1 : scale)) << f->parameters()[k].name;
      }
    }
}

TEST(Drag, StepsAreBoundedAndControlsStayOnTheSurface) {
  const auto f = row_of_blobs(4);
  ControlSession session(*f);
  const Vec3 a = on_surface(*f, Vec3(0.8, 0.9, 0), 1);
  session.add(a);
  session.aim(0, a + Vec3(0, 5, 0));
  std::vector<double> before = values(*f);
  for (int i = 0; i < 20; ++i) {
    const Vec3 was = session.controls()[0].position;
    const StepReport r = session.step(1 / 60.0);
    ASSERT_EQ(r.outcome, Outcome::Moving);
    const Vec3 now = session.controls()[0].position;
    EXPECT_LE((now - was).norm(), 0.05 * session.length() * (1 + 1e-12));
    EXPECT_LE(std::abs(r.residual[0]), 1e-8 * session.length());
    const std::vector<double> after = values(*f);
    for (std::size_t k = 0; k < after.size(); ++k)
      ASSERT_LE(std::abs(after[k] - before[k]), 0.2 * session.length()) << "jump";
    before = after;
  }
}

TEST(Drag, DuplicatedControlsAreHarmless) {
  const auto f = row_of_blobs(3), g = row_of_blobs(3);
  ControlSession once(*f), thrice(*g);
  const Vec3 a = on_surface(*f, Vec3(0.8, 0.9, 0), 1);
  once.add(a);
  once.aim(0, a + Vec3(0.1, 0.2, 0.1));
  for (std::size_t i = 0; i < 3; ++i) {
    thrice.add(a);
    thrice.aim(i, a + Vec3(0.1, 0.2, 0.1));
  }
  EXPECT_EQ(once.run().outcome, Outcome::Arrived);
  const StepReport r = thrice.run();
  EXPECT_EQ(r.outcome, Outcome::Arrived);
  EXPECT_EQ(r.rank, 1u);
  EXPECT_EQ(r.status, Status::Solved);
  for (std::size_t k = 0; k < values(*f).size(); ++k) EXPECT_NEAR(values(*f)[k], values(*g)[k], 1e-9);
}

TEST(Drag, ContradictingControlsGiveACompromiseAndSaySo) {
  const auto f = ball();
  DragOptions o;
  o.freeze = {"center"};
  ControlSession session(*f, o);
  session.add({1, 0, 0});
  session.add({0, 1, 0});
  session.aim(0, {1.1, 0, 0});
  const StepReport r = session.run();
  EXPECT_EQ(r.status, Status::LeastSquares);
  EXPECT_EQ(r.rank, 1u);
  EXPECT_EQ(r.parameters, 1u);
  EXPECT_NEAR(value(*f, "radius"), 1.05, 1e-9);
  EXPECT_EQ(r.conflicts, (std::vector<std::size_t>{0, 1}));
  EXPECT_NEAR(r.residual[0], 0.05, 1e-9);
  EXPECT_NEAR(r.residual[1], -0.05, 1e-9);
}

TEST(Drag, SidewaysDragsMoveTheStuff) {
  for (const double scale : {0.01, 1.0, 1000.0}) {
    const auto f = ball(scale), g = ball(scale);
    ControlSession plain(*f), sideways(*g);
    for (ControlSession* s : {&plain, &sideways}) {
      s->add(Vec3(0, scale, 0), s == &sideways);
      s->aim(0, Vec3(0.5, 1, 0) * scale);
      EXPECT_EQ(s->run().outcome, Outcome::Arrived);
    }
    EXPECT_NEAR(value(*g, "center.x"), 0.5 * scale, 1e-9 * scale);
    EXPECT_NEAR(value(*g, "center.y"), 0, 1e-9 * scale);
    EXPECT_NEAR(value(*g, "radius"), scale, 1e-9 * scale);
    EXPECT_LT(value(*f, "center.x"), 0.4 * scale) << "without, the surface only passes through the point";
    EXPECT_EQ(sideways.step(1).rank, 1u) << "rows of the drag do not count";
  }
}

TEST(Drag, SidewaysRowsWithoutAMoverAreLeftOut) {
  const auto f = ball();
  DragOptions o;
  o.freeze = {"center"};
  ControlSession session(*f, o);
  session.add({0, 1, 0}, true);
  session.aim(0, {0, 1.5, 0});
  EXPECT_EQ(session.run().outcome, Outcome::Arrived);
  EXPECT_NEAR(value(*f, "radius"), 1.5, 1e-9);
}

TEST(Drag, TiedParametersAreOneUnknown) {
  field::Inputs inputs;
  for (const double x : {0.0, 5.0})
    inputs.push_back(field::sphere({Number::frozen(x), Number::frozen(0), Number::frozen(0)}, Number::named("r", 1)));
  const auto f = field::set_union(std::move(inputs));
  ControlSession session(*f);
  session.add({0, 1, 0});
  session.aim(0, {0, 1.4, 0});
  EXPECT_EQ(session.run().parameters, 1u);
  EXPECT_NEAR(field::value_at(*f, {5, 1.4, 0}), 0, 1e-9) << "the other ball grew as well";
}

TEST(Drag, BoundsOfParametersHold) {
  const auto f = field::sphere({Number::frozen(0), Number::frozen(0), Number::frozen(0)}, Number::named("r", 1, 0.5, 1.2));
  ControlSession session(*f);
  session.add({1, 0, 0});
  session.aim(0, {1.3, 0, 0});
  const StepReport r = session.run();
  EXPECT_LE(value(*f, "r"), 1.2);
  EXPECT_NEAR(value(*f, "r"), 1.2, 1e-9);
  EXPECT_EQ(r.at_bound, 1u);
  EXPECT_EQ(r.status, Status::LeastSquares);
  EXPECT_NEAR(r.residual[0], 0.1, 1e-9);
  // A radius never reaches zero.
  const auto g = ball();
  DragOptions o;
  o.freeze = {"center"};
  ControlSession inwards(*g, o);
  inwards.add({1, 0, 0});
  inwards.aim(0, {-1, 0, 0});
  inwards.run();
  EXPECT_GT(value(*g, "radius"), 0);
}

TEST(Drag, ResultsDoNotDependOnAParametersUnit) {
  // The same ball, its radius once in metres and once in millimetres.
  const auto ball_with = [](const std::string& r, double v) {
    return std::make_unique<field::Expression>(
        "sqrt((x-cx)^2+y^2+z^2)-" + r, std::vector<std::pair<std::string, Number>>{{"cx", Number(0.0)}, {"r", Number(v)}},
        Box::around(Vec3::Zero(), 4));
  };
  const auto f = ball_with("r", 1), g = ball_with("r/1000", 1000);
  for (Field* s : std::initializer_list<Field*>{f.get(), g.get()}) {
    ControlSession session(*s);
    session.add({1, 0, 0});
    session.aim(0, {1.5, 0, 0});
    EXPECT_EQ(session.run().outcome, Outcome::Arrived);
  }
  EXPECT_NEAR(value(*f, "cx"), 0.25, 1e-9) << "shared evenly";
  EXPECT_NEAR(value(*f, "r"), 1.25, 1e-9);
  EXPECT_NEAR(value(*g, "cx"), 0.25, 1e-9);
  EXPECT_NEAR(value(*g, "r"), 1250, 1e-6);
}

TEST(Drag, FourSurfacesNeitherJumpNorFlipAndComeBack) {
  for (const double scale : {1.0, 1000.0})
    for (test::DragScene& scene : test::drag_scenes(scale)) {
      const test::DragMeasure m = test::drag_around(scene, scale);
      EXPECT_LE(m.hysteresis, 1e-6) << scene.name;
      EXPECT_EQ(m.flips, 0u) << scene.name;
      EXPECT_EQ(m.failed, 0u) << scene.name;
      EXPECT_LE(m.jump, 3) << scene.name << ": the surface moves no more than a few times as far as the hand";
    }
}

TEST(Drag, AMetricOfTheWholeSurfaceSparesWhatBulgesEverywhere) {
  const auto row = [] {
    std::vector<field::SegmentBlob> items;
    for (int i = 0; i < 7; ++i)
      items.push_back(
          {{Number(0.5 * i), Number(-0.5), Number(0.0)}, {Number(0.5 * i), Number(0.5), Number(0.0)}, Number(0.45)});
    return field::segments(BlobKernel::Gaussian, Number::frozen(0.35), items);
  };
  const auto samples_of = [](const Field& f) {
    std::vector<Vec3> samples;
    for (int i = 0; i < 1000; ++i) {
      const double x = -0.5 + 0.004 * i, a = 2.4 * i;
      if (const auto p = nearest_surface_point(f, Vec3(x, 1.2 * std::cos(a), 0.6 * std::sin(a)), 3)) samples.push_back(*p);
    }
    return samples;
  };
  std::vector<double> bulges;
  for (const bool all_over : {false, true}) {
    const auto f = row();
    DragOptions o;
    if (all_over) o.samples = samples_of(*f);
    ControlSession session(*f, o);
    const Vec3 top = on_surface(*f, Vec3(1.5, 1.1, 0), 3);
    session.add(top);
    session.aim(0, top + Vec3(0, 0.8, 0));
    EXPECT_EQ(session.run().outcome, Outcome::Arrived);
    EXPECT_NEAR(field::value_at(*f, top + Vec3(0, 0.8, 0)), 0, 1e-8);
    bulges.push_back(value(*f, "items[3].radius") - 0.45);
  }
  EXPECT_GT(bulges[0], 0.3) << "the least change at the control alone is a fatter cylinder";
  EXPECT_LT(bulges[1], 0.1);

  // Units do not count here either: a ball's radius in metres and in millimetres.
  std::vector<std::vector<double>> found;
  for (const double unit : {1.0, 1000.0}) {
    field::Expression ball("sqrt((x-cx)^2+y^2+z^2)-r/" + std::to_string(unit), {{"cx", Number(0.0)}, {"r", Number(unit)}},
                           Box::around(Vec3::Zero(), 4));
    DragOptions o;
    for (int a = 0; a < 3; ++a)
      for (const double side : {-1.0, 1.0}) o.samples.push_back(side * Vec3::Unit(a));
    ControlSession session(ball, o);
    session.add({1, 0, 0});
    session.aim(0, {1.5, 0, 0});
    EXPECT_EQ(session.run().outcome, Outcome::Arrived);
    found.push_back({value(ball, "cx"), value(ball, "r") / unit});
  }
  // The mean square of the normal motion: 1/3 for a shift, 1 for the radius.
  EXPECT_NEAR(found[0][0], 0.375, 1e-9);
  EXPECT_NEAR(found[0][1], 1.125, 1e-9);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_NEAR(found[1][k], found[0][k], 1e-9);
}

TEST(Drag, BadInputLeavesTheShapeAlone) {
  const auto f = ball();
  const std::vector<double> before = values(*f);
  const double nan = std::nan("");
  ControlSession session(*f);
  EXPECT_THROW(session.add({nan, 0, 0}), InvalidInput);
  EXPECT_THROW(session.add({3, 0, 0}), InvalidInput) << "not on the surface";
  EXPECT_NEAR(session.add({1.01, 0, 0}).moved, 0.01, 1e-12) << "moved onto it";
  EXPECT_THROW(session.aim(0, {nan, 0, 0}), InvalidInput);
  EXPECT_THROW(session.aim(1, {1, 0, 0}), InvalidInput);
  EXPECT_THROW(session.step(0), InvalidInput);
  EXPECT_THROW(session.step(nan), InvalidInput);
  DragOptions o;
  o.freeze = {"radus"};
  EXPECT_THROW(ControlSession(*f, o), InvalidInput);
  EXPECT_EQ(values(*f), before);
}

TEST(Drag, NoParametersInReachIsSaid) {
  const auto f = field::sphere({Number::frozen(0), Number::frozen(0), Number::frozen(0)}, Number::frozen(1));
  ControlSession session(*f);
  session.add({1, 0, 0});
  session.aim(0, {1.2, 0, 0});
  const StepReport r = session.run();
  EXPECT_EQ(r.outcome, Outcome::Unchanged);
  EXPECT_EQ(r.status, Status::NoParameters);
  EXPECT_EQ(r.parameters, 0u);
  EXPECT_EQ(session.controls()[0].position, Vec3(1, 0, 0)) << "the control stays with the surface";
}

TEST(Drag, APartWithoutParametersInReachIsSaidAndTheRestStays) {
  field::Inputs inputs;
  for (const double x : {0.0, 5.0}) inputs.push_back(field::sphere({Number(x), Number(0.0), Number(0.0)}, Number(1.0)));
  const auto f = field::set_union(std::move(inputs));
  const std::vector<double> before = values(*f);
  DragOptions o;
  o.freeze = {"inputs[1]"};
  ControlSession session(*f, o);
  session.add({5, 1, 0}, true);
  session.aim(0, {5, 1.4, 0});
  const StepReport r = session.run();
  EXPECT_EQ(r.outcome, Outcome::Unchanged);
  EXPECT_EQ(r.status, Status::NoParameters);
  EXPECT_EQ(r.parameters, 4u) << "there are some, elsewhere";
  EXPECT_EQ(values(*f), before);
}

TEST(Drag, WhatFollowsSeesTheOldPoseWithRates) {
  const auto f = ball();
  ControlSession session(*f);
  session.add({1, 0, 0});
  session.aim(0, {1.2, 0, 0});
  // A floater opposite the control, carried by F_t alone.
  Vec3 p(0, 1, 0);
  double largest = 0;
  const auto follow = [&](const Field& s, double dt) {
    const auto jet = field::evaluate(s, {p}, field::Order::GradientTime);
    const Vec3 g = jet.gradient(0);
    p -= (jet.time(0) * dt + jet.value(0)) / g.squaredNorm() * g;
    largest = std::max(largest, std::abs(jet.value(0)));
  };
  for (int i = 0; i < 200; ++i) session.step(1 / 60.0, follow);
  EXPECT_LT(largest, 1e-3);
  EXPECT_NEAR(field::value_at(*f, p), 0, 1e-9);
  EXPECT_GT(value(*f, "radius"), 1.05);
}

}  // namespace
}  // namespace meniscus::control
