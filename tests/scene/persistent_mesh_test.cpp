#include <meniscus/base/run_control.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/primitives.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/scene/persistent_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <set>

namespace meniscus::scene {
namespace {

/// A surface that is told where to be: known answers for what follows it.
class Told final : public LivingSurface {
 public:
  using Shape = std::function<std::unique_ptr<field::Field>(double)>;
  using Velocity = std::function<Vec3(const Vec3&, double)>;
  Told(Shape shape, Velocity velocity, double voxel, double duration)
      : shape_(std::move(shape)), velocity_(std::move(velocity)), voxel_(voxel), duration_(duration), band_(voxel) {}

  void advance(std::size_t index, const RunControl& run) override {
    time_ = duration_ * static_cast<double>(index);
    const auto field = shape_(time_);
    band_ = field ? band::band_of(*field, voxel_, {}, 1u << 20, run) : band::Band(voxel_);
  }
  const band::Band& band() const override { return band_; }
  std::vector<Vec3> velocities(std::span<const Vec3> at, const RunControl&) const override {
    std::vector<Vec3> v;
    for (const Vec3& x : at) v.push_back(velocity_(x, time_));
    return v;
  }
  nlohmann::json state() override { return {}; }
  void resume(std::size_t index, band::Band, const nlohmann::json&, const RunControl& run) override { advance(index, run); }

 private:
  Shape shape_;
  Velocity velocity_;
  double voxel_, duration_, time_ = 0;
  band::Band band_;
};

constexpr double kFrame = 0.5;

Told moving_ball(double scale) {
  return {[=](double t) {
            return field::sphere({0.3 * scale * t, 0.1 * scale * t, 0}, scale);
          },
          [=](const Vec3&, double) { return Vec3(0.3 * scale, 0.1 * scale, 0); }, 0.1 * scale, kFrame};
}

/// Two balls that come together along x, each at the speed `v`.
Told meeting_balls() {
  const auto v = [](const Vec3& x, double) { return Vec3(x.x() < 0 ? 0.1 : -0.1, 0, 0); };
  const auto shape = [](double t) {
    field::Inputs balls;
    for (const double side : {-1.0, 1.0}) balls.push_back(field::sphere({side * (1.3 - 0.1 * t), 0, 0}, 1));
    return field::blend(std::move(balls), 0.2);
  };
  return {shape, v, 0.12, kFrame};
}

void expect_good(const mesh::Mesh& mesh, const std::string& where) {
  const mesh::Audit audit = mesh::validate(mesh);
  EXPECT_TRUE(audit.good()) << where << ": " << mesh::summary(audit);
  const auto ids = mesh.attributes.integers("id");
  EXPECT_EQ(std::set<std::int64_t>(ids.begin(), ids.end()).size(), mesh.positions.size()) << where;
  EXPECT_EQ(mesh.attributes.values("rest", 3).size(), 3 * mesh.positions.size()) << where;
}

/// How far the normals of a ball's mesh are from the ball's.
double worst_turn(const mesh::Mesh& mesh, const Vec3& center) {
  const auto n = mesh.attributes.values("N", 3);
  double worst = 0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    worst = std::max(worst, (Vec3(n[3 * i], n[3 * i + 1], n[3 * i + 2]) - (mesh.positions[i] - center).normalized()).norm());
  return worst;
}

TEST(PersistentMesh, RidesOnABallThatMovesAsItIs) {
  for (const double scale : {1.0, 0.01, 1000.0}) {
    Told ball = moving_ball(scale);
    PersistentMesh mesh;
    ball.advance(0, {});
    EXPECT_EQ(mesh.follow(ball, 0).reason, "first");
    const mesh::Mesh first = mesh.mesh();
    for (std::size_t frame = 1; frame < 9; ++frame) {
      ball.advance(frame, {});
      const MeshChange change = mesh.follow(ball, kFrame);
      EXPECT_EQ(change.reason, "");
      EXPECT_EQ(change.carried, first.positions.size());
    }
    ASSERT_EQ(mesh.mesh().positions.size(), first.positions.size());
    EXPECT_TRUE(mesh.mesh().triangles == first.triangles);
    EXPECT_TRUE(std::ranges::equal(mesh.mesh().attributes.integers("id"), first.attributes.integers("id")));
    const Vec3 way(0.3 * scale * 8 * kFrame, 0.1 * scale * 8 * kFrame, 0);
    double slip = 0;
    for (std::size_t i = 0; i < first.positions.size(); ++i)
      slip = std::max(slip, (mesh.mesh().positions[i] - way - first.positions[i]).norm() / scale);
    EXPECT_LT(slip, 0.1) << "more than a voxel";
    EXPECT_LE(worst_turn(mesh.mesh(), way), worst_turn(mesh_of(ball.band()), way)) << "normals worse than of a new mesh";
    expect_good(mesh.mesh(), "moved");
  }
}

TEST(PersistentMesh, VelocitiesAreThoseOfTheVerticesAsTheyAre) {
  Told spinning(
      [](double) {
        return field::torus({0, 0, 0}, {0, 0, 1}, 1, 0.4);
      },
      [](const Vec3& x, double) { return Vec3(-x.y(), x.x(), 0); }, 0.1, 0.1);
  PersistentMesh mesh;
  for (std::size_t frame = 0; frame < 4; ++frame) {
    spinning.advance(frame, {});
    mesh.follow(spinning, 0.1);
  }
  const auto v = mesh.mesh().attributes.values("v", 3);
  const auto rest = mesh.mesh().attributes.values("rest", 3);
  double worst = 0;
  for (std::size_t i = 0; i < mesh.mesh().positions.size(); ++i) {
    const Vec3& x = mesh.mesh().positions[i];
    EXPECT_EQ(Vec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]), Vec3(-x.y(), x.x(), 0));
    // Where it would be, had it only been turned: by three tenths of a radian, to the second order of a step.
    const double c = std::cos(0.3), s = std::sin(0.3), a = rest[3 * i], b = rest[3 * i + 1];
    worst = std::max(worst, (x - Vec3(c * a - s * b, s * a + c * b, rest[3 * i + 2])).norm());
  }
  EXPECT_LT(worst, 0.1);
}

TEST(PersistentMesh, BallsThatMeetAreMendedWhereTheyMeet) {
  Told balls = meeting_balls();
  PersistentMesh mesh;
  std::set<std::int64_t> first;
  std::size_t changes = 0;
  std::int64_t largest = -1;
  for (std::size_t frame = 0; frame < 12; ++frame) {
    balls.advance(frame, {});
    const std::set<std::int64_t> before = [&] {
      const auto ids = mesh.mesh().attributes.integers("id");
      return std::set<std::int64_t>(ids.begin(), ids.end());
    }();
    const MeshChange change = mesh.follow(balls, kFrame);
    expect_good(mesh.mesh(), "frame " + std::to_string(frame));
    const auto ids = mesh.mesh().attributes.integers("id");
    if (frame == 0) first = {ids.begin(), ids.end()};
    for (std::size_t i = 0; i < ids.size(); ++i)
      EXPECT_TRUE(i < change.carried ? before.contains(ids[i]) : ids[i] > largest) << "an id that is neither kept nor new";
    largest = std::max(largest, *std::max_element(ids.begin(), ids.end()));
    changes += change.reason == "topology";
    if (change.reason.empty()) EXPECT_TRUE(change.regions.empty());
    if (change.reason == "topology") {
      EXPECT_GT(change.carried, mesh.mesh().positions.size() / 2);
      for (const Box& box : change.regions) EXPECT_LT(std::abs(box.center().x()), 0.5) << "far from where they meet";
    }
  }
  EXPECT_EQ(changes, 1u);
  EXPECT_EQ(mesh::validate(mesh.mesh()).components, 1u);
  const auto last = mesh.mesh().attributes.integers("id");
  EXPECT_GT(std::ranges::count_if(last, [&](std::int64_t id) { return first.contains(id); }),
            static_cast<std::ptrdiff_t>(first.size() / 2));
}

TEST(PersistentMesh, TrianglesOfABallThatGrowsStayOfTheVoxelsSize) {
  Told ball(
      [](double t) {
        return field::sphere({0, 0, 0}, 0.5 + 0.1 * t);
      },
      [](const Vec3& x, double) { return Vec3(0.1 * x.normalized()); }, 0.1, 1);
  PersistentMesh mesh;
  std::size_t mended = 0;
  for (std::size_t frame = 0; frame < 21; ++frame) {
    ball.advance(frame, {});
    mended += mesh.follow(ball, 1).reason == "stretched";
    expect_good(mesh.mesh(), "frame " + std::to_string(frame));
    for (const Triangle& t : mesh.mesh().triangles)
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_LT((mesh.mesh().positions[static_cast<std::size_t>(t[k])] -
                   mesh.mesh().positions[static_cast<std::size_t>(t[(k + 1) % 3])])
                      .norm(),
                  0.35);
  }
  EXPECT_GT(mended, 0u);
}

TEST(PersistentMesh, SurfacesMayBeBornAndVanish) {
  Told blink(
      [](double t) {
        return t > 0 && t < 2 ? field::sphere({0, 0, 0}, 1) : std::unique_ptr<field::Field>();
      },
      [](const Vec3&, double) { return Vec3(Vec3::Zero()); }, 0.2, 1);
  PersistentMesh mesh;
  std::vector<std::size_t> vertices;
  for (std::size_t frame = 0; frame < 3; ++frame) {
    blink.advance(frame, {});
    mesh.follow(blink, 1);
    vertices.push_back(mesh.mesh().positions.size());
    if (frame == 1) expect_good(mesh.mesh(), "born");
  }
  EXPECT_EQ(vertices[0], 0u);
  EXPECT_GT(vertices[1], 100u);
  EXPECT_EQ(vertices[2], 0u);
}

TEST(PersistentMesh, SameBitsForAnyThreadCountAndWhenResumed) {
  const auto last = [](const RunControl& run, bool interrupted) {
    Told balls = meeting_balls();
    PersistentMesh mesh;
    for (std::size_t frame = 0; frame < 10; ++frame) {
      balls.advance(frame, run);
      mesh.follow(balls, kFrame, run);
      if (interrupted && frame % 3 == 1) {
        PersistentMesh other;
        other.resume(mesh.state());
        mesh = other;
      }
    }
    return mesh.mesh();
  };
  const mesh::Mesh one = last(RunControl({.threads = 1, .on_progress = {}}), false);
  for (const int threads : {2, 3, 5, 8}) {
    const mesh::Mesh m = last(RunControl({.threads = threads, .on_progress = {}}), threads == 3);
    EXPECT_TRUE(m.positions == one.positions && m.triangles == one.triangles) << threads << " threads";
    EXPECT_TRUE(std::ranges::equal(m.attributes.integers("id"), one.attributes.integers("id"))) << threads << " threads";
  }
}

}  // namespace
}  // namespace meniscus::scene
