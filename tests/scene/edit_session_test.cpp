#include <meniscus/base/error.h>
#include <meniscus/polygonize/polygonize.h>
#include <meniscus/scene/edit_session.h>

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace meniscus::scene {
namespace {

const char* kBlobs = R"({"format":"meniscus.scene","version":1,
  "surface":{"type":"blobs","kernel":"gaussian","bias":0.3,"freeze":["bias"],"items":[
    {"center":[0,0,0],"radius":0.9,"weight":1},{"center":[0.8,0.1,0],"radius":0.9,"weight":1},
    {"center":[1.6,0,0],"radius":0.9,"weight":1}]}})";

std::vector<double> values(const field::Field& f) {
  std::vector<double> q;
  for (const auto& p : f.parameters()) q.push_back(p.value);
  return q;
}

Vec3 top(EditSession& session) { return *control::nearest_surface_point(session.surface(), Vec3(0.8, 1.2, 0), 3); }

double farthest(const field::Field& surface, const sample::Floaters& floaters) {
  double far = 0;
  for (std::size_t i = 0; i < floaters.size(); ++i) {
    const Vec3 p = floaters.points().position(i);
    const auto jet = field::evaluate(surface, {p}, field::Order::Gradient);
    far = std::max(far, std::abs(jet.value(0)) / jet.gradient(0).norm());
  }
  return far;
}

TEST(EditSession, OneCallAdvancesControlsUnknownsAndFloaters) {
  EditSession session(Document::parse(kBlobs, "blobs.json"));
  session.show_floaters(200);
  ASSERT_NE(session.floaters(), nullptr);
  ASSERT_NEAR(static_cast<double>(session.floaters()->size()), 200, 5);
  const double spacing = 2.017 * session.floaters()->radii()[0];
  control::ControlSession& controls = session.begin_stroke();
  const Vec3 start = top(session);
  controls.add(start);
  controls.aim(0, start + Vec3(0, 3, 0));
  std::set<std::int64_t> alive(session.floaters()->ids().begin(), session.floaters()->ids().end());
  std::size_t born = 0;
  EditStep step;
  for (int i = 0; i < 150; ++i) {
    step = session.step(1 / 60.0);
    ASSERT_LE(farthest(session.surface(), *session.floaters()), 0.25 * spacing) << "step " << i;
    for (const auto id : step.floaters.born) EXPECT_TRUE(alive.insert(id).second);
    born += step.floaters.born.size();
    for (const auto id : step.floaters.died) EXPECT_EQ(alive.erase(id), 1u);
    for (const auto id : step.floaters.lost) EXPECT_EQ(alive.erase(id), 1u);
  }
  EXPECT_EQ(step.control.outcome, control::StepReport::Outcome::Arrived);
  EXPECT_EQ(controls.controls()[0].position, start + Vec3(0, 3, 0));
  EXPECT_NEAR(field::value_at(session.surface(), start + Vec3(0, 3, 0)), 0, 1e-7);
  EXPECT_GT(born, 10u) << "the surface grew";
  EXPECT_EQ(alive, std::set<std::int64_t>(session.floaters()->ids().begin(), session.floaters()->ids().end()));
  EXPECT_LE(farthest(session.surface(), *session.floaters()), 1e-3 * spacing);
  // They cover the surface, the part that was pulled out included.
  const Box box = control::tight_bounds(session.surface());
  EXPECT_GT(session.floaters()->measured(session.surface()).packing, 0.4);
  EXPECT_GT(box.max.y(), start.y() + 3);
}

TEST(EditSession, OneDragIsOneEntryAndIsTakenBackWhole) {
  EditSession session(Document::parse(kBlobs, "blobs.json"));
  session.show_floaters(200);
  const auto first_document = session.document().json();
  const std::vector<double> first = values(session.surface());
  const auto drag = [&](const Vec3& by) {
    control::ControlSession& controls = session.begin_stroke();
    const Vec3 start = top(session);
    controls.add(start);
    controls.aim(0, start + by);
    for (int i = 0; i < 40; ++i) session.step(1 / 60.0);
    EXPECT_EQ(session.run().control.outcome, control::StepReport::Outcome::Arrived);
    session.end_stroke("drag");
  };
  drag(Vec3(0, 0.4, 0));
  const std::vector<double> second = values(session.surface());
  const auto second_document = session.document().json();
  drag(Vec3(0, 0, 0.3));
  const std::vector<double> third = values(session.surface());
  EXPECT_EQ(session.history().size(), 2u) << "forty steps, one entry";
  EXPECT_NE(second, third);
  EXPECT_TRUE(session.undo());
  EXPECT_EQ(values(session.surface()), second);
  EXPECT_EQ(session.document().json(), second_document);
  EXPECT_TRUE(session.undo());
  EXPECT_EQ(values(session.surface()), first);
  EXPECT_EQ(session.document().json(), first_document);
  EXPECT_FALSE(session.undo());
  EXPECT_TRUE(session.redo());
  EXPECT_TRUE(session.redo());
  EXPECT_FALSE(session.redo());
  EXPECT_EQ(values(session.surface()), third);
  // A stroke that was not ended is given up.
  session.begin_stroke().add(top(session));
  session.controls().aim(0, Vec3(0.8, 2, 0));
  session.step(0.1);
  EXPECT_NE(values(session.surface()), third);
  EXPECT_TRUE(session.undo());
  EXPECT_EQ(values(session.surface()), second);
  EXPECT_THROW(session.controls(), InvalidInput);
  EXPECT_THROW(session.step(0.1), InvalidInput);
}

TEST(EditSession, AreaAndVolumeAreReached) {
  EditSession session(Document::parse(kBlobs, "blobs.json"));
  const auto measured = [&](control::Measure what) {
    polygonize::PolygonizeOptions how;
    how.voxel = 0.05;
    const mesh::Mesh m = polygonize::polygonize(session.surface(), how).mesh;
    return what == control::Measure::Area ? mesh::area(m) : mesh::volume(m);
  };
  for (const control::Measure goal : {control::Measure::Volume, control::Measure::Area}) {
    const double wanted = (goal == control::Measure::Volume ? 1.5 : 0.8) * measured(goal);
    const control::GoalReport report = session.reach(goal, wanted);
    EXPECT_TRUE(report.reached);
    EXPECT_LE(report.steps, 10) << "Newton's method with a true row";
    EXPECT_NEAR(measured(goal), wanted, 5e-3 * wanted);
    session.end_stroke("goal");
  }
  EXPECT_EQ(session.history().size(), 2u);
  EXPECT_FALSE(session.reach(control::Measure::Volume, 100, {"items"}).reached) << "all is frozen";
}

TEST(EditSession, FloatersNeedBoundsAndASurface) {
  EditSession plane(Document::parse(
      R"({"format":"meniscus.scene","version":1,"surface":{"type":"plane","point":[0,0,0],"normal":[0,1,0]}})", "p.json"));
  EXPECT_THROW(plane.show_floaters(100), InvalidInput);
  EditSession none(Document::parse(
      R"({"format":"meniscus.scene","version":1,"surface":{"type":"blobs","kernel":"compact","bias":2,"items":[
        {"center":[0,0,0],"radius":1,"weight":1}]}})",
      "n.json"));
  none.show_floaters(100);
  EXPECT_EQ(none.floaters(), nullptr);
}

}  // namespace
}  // namespace meniscus::scene
