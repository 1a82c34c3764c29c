// How crisp are sharp edges of meshes? For edges of known angle: how far the true edge is from the mesh, how much of the
// mesh beside it faces the wrong way, and whether the mesh is sound. Usage: bench_creases [--voxel H] [--json FILE]
#include <meniscus/base/random.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/expression.h>
#include <meniscus/field/primitives.h>
#include <meniscus/mesh/validate.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/polygonize/polygonize.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <numbers>
#include <string>

using namespace meniscus;

namespace {

enum class Join { Intersection, Difference };

/// Two surfaces, how they are joined, and where edges are looked at.
struct Case {
  std::string name;
  std::unique_ptr<field::Field> a, b;
  Join join = Join::Intersection;
  double reach = 1;  // of the part looked at, about the origin
  double rim = 0;    // a ball that bounds the part, if any
};

field::Number3 at(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

std::unique_ptr<field::Field> joined(const Case& c) {
  field::Inputs inputs;
  inputs.push_back(c.a->clone());
  inputs.push_back(c.b->clone());
  if (c.rim > 0) inputs.push_back(field::sphere(at(Vec3::Zero()), c.rim));
  return c.join == Join::Difference ? field::set_difference(std::move(inputs)) : field::set_intersection(std::move(inputs));
}

Mat3 turned(std::uint64_t seed) {
  const auto r = random_uniform(seed, 1, 0);
  return Eigen::Quaterniond(r[0] - 0.5, r[1] - 0.5, r[2] - 0.5, r[3] - 0.5).normalized().toRotationMatrix();
}

/// Two half-spaces with that angle between their faces.
Case wedge(double degrees, std::uint64_t seed) {
  const double half = degrees / 360 * std::numbers::pi;
  const Mat3 turn = turned(seed);
  const Vec3 place(0.011, 0.007, -0.013);
  Case c;
  c.name = "wedge";
  c.a = field::plane(at(place), at(turn * Vec3(std::sin(half), std::cos(half), 0)));
  c.b = field::plane(at(place), at(turn * Vec3(std::sin(half), -std::cos(half), 0)));
  c.reach = 0.75;
  c.rim = 1;
  return c;
}

/// What two unit balls have in common (`Intersection`), or one less the other.
Case balls(double degrees, Join join, std::uint64_t seed) {
  const double half = degrees / 360 * std::numbers::pi;
  const double apart = join == Join::Intersection ? std::cos(half) : std::sin(half);
  const Vec3 axis = turned(seed) * Vec3(apart, 0, 0);
  Case c;
  c.name = join == Join::Intersection ? "lens" : "crescent";
  c.a = field::sphere(at(axis), 1);
  c.b = field::sphere(at(-axis), 1);
  c.join = join;
  c.reach = 1.5;
  return c;
}

/// A wall along a gyroid, cut by a ball: edges of all angles.
Case gyroid() {
  Case c;
  c.name = "gyroid wall in a ball";
  c.a = std::make_unique<field::Expression>(
      "(abs(sin(2*pi*x)*cos(2*pi*y) + sin(2*pi*y)*cos(2*pi*z) + sin(2*pi*z)*cos(2*pi*x)) - 0.35)/9.5");
  c.b = field::sphere(at(Vec3::Zero()), 1.2);
  c.reach = 1.3;
  return c;
}

struct EdgePoint {
  Vec3 place;
  double degrees;  // between the faces
};

/// Points on both surfaces, from places all over.
std::vector<EdgePoint> edge_points(const Case& c) {
  std::vector<EdgePoint> found;
  const double turn = c.join == Join::Difference ? -1 : 1;
  for (std::uint64_t i = 0; i < 6000; ++i) {
    const auto r = random_uniform(17, i, 0);
    Vec3 x = c.reach * (2 * Vec3(r[0], r[1], r[2]) - Vec3::Ones());
    for (int step = 0; step < 40; ++step) {
      const auto a = field::evaluate(*c.a, std::vector<Vec3>{x}, field::Order::Gradient);
      const auto b = field::evaluate(*c.b, std::vector<Vec3>{x}, field::Order::Gradient);
      const Vec3 ga = a.gradient(0), gb = b.gradient(0);
      const double aa = ga.squaredNorm(), bb = gb.squaredNorm(), ab = ga.dot(gb), d = aa * bb - ab * ab;
      if (!(d > 1e-6 * aa * bb)) break;
      const double fa = a.value(0), fb = b.value(0);
      if (std::abs(fa) < 1e-12 && std::abs(fb) < 1e-12) {
        const double cosine = turn * ab / std::sqrt(aa * bb);
        if (x.norm() < c.reach) found.push_back({x, 180 - std::acos(cosine) * 180 / std::numbers::pi});
        break;
      }
      x -= (bb * fa - ab * fb) / d * ga + (aa * fb - ab * fa) / d * gb;
    }
  }
  return found;
}

double squared_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  const auto inside = [&](const Vec3& u, const Vec3& v) { return n.dot((v - u).cross(p - u)) >= 0; };
  if (n.squaredNorm() > 0 && inside(a, b) && inside(b, c) && inside(c, a)) {
    const double h = n.dot(p - a);
    return h * h / n.squaredNorm();
  }
  const auto side = [&](const Vec3& u, const Vec3& v) {
    const Vec3 d = v - u;
    const double t = d.squaredNorm() > 0 ? std::clamp(d.dot(p - u) / d.squaredNorm(), 0.0, 1.0) : 0;
    return (u + t * d - p).squaredNorm();
  };
  return std::min({side(a, b), side(b, c), side(c, a)});
}

/// Figures of one mesh, lengths in voxels.
struct Figures {
  double mean = 0, p99 = 0, worst = 0;  // distance of the true edge to the mesh
  double wrong = 0;  // share of the area within 2 voxels of the edge that faces 15 degrees off both sheets
  long long components = 0, genus = 0;
  bool good = false;
  double seconds = 0;
  std::size_t triangles = 0;
};

Figures measured(const Case& c, const std::vector<EdgePoint>& edge, double voxel) {
  Figures f;
  const auto field = joined(c);
  const std::clock_t cpu = std::clock();
  const mesh::Mesh mesh = polygonize::polygonize(*field, {.voxel = voxel}).mesh;
  f.seconds = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  const mesh::Audit audit = mesh::validate(mesh);
  f.good = audit.good();
  f.components = static_cast<long long>(audit.components);
  f.genus = audit.genus.value_or(-1);
  f.triangles = mesh.triangles.size();

  std::vector<Vec3> centers, normals;
  std::vector<double> areas;
  double longest = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 a = mesh.positions[static_cast<std::size_t>(t[0])], b = mesh.positions[static_cast<std::size_t>(t[1])],
               d = mesh.positions[static_cast<std::size_t>(t[2])];
    centers.push_back((a + b + d) / 3);
    normals.push_back((b - a).cross(d - a).normalized());
    areas.push_back(0.5 * (b - a).cross(d - a).norm());
    longest = std::max({longest, (a - centers.back()).norm(), (b - centers.back()).norm(), (d - centers.back()).norm()});
  }
  const points::NeighbourSearch search(centers);
  std::vector<points::Neighbour> near;
  std::vector<double> gaps;
  std::vector<char> beside(centers.size(), 0);
  for (const EdgePoint& e : edge) {
    search.within(e.place, 4 * voxel + longest, near);
    double best = 16 * voxel * voxel;
    for (const points::Neighbour& n : near) {
      const Triangle& t = mesh.triangles[n.index];
      const auto p = [&](std::size_t k) { return mesh.positions[static_cast<std::size_t>(t[k])]; };
      best = std::min(best, squared_distance(e.place, p(0), p(1), p(2)));
      if (n.squared_distance < 4 * voxel * voxel) beside[n.index] = 1;
    }
    gaps.push_back(std::sqrt(best) / voxel);
  }
  std::sort(gaps.begin(), gaps.end());
  for (const double g : gaps) f.mean += g / static_cast<double>(gaps.size());
  f.p99 = gaps[gaps.size() * 99 / 100];
  f.worst = gaps.back();

  const double turn = c.join == Join::Difference ? -1 : 1;
  const auto a = field::evaluate(*c.a, centers, field::Order::Gradient);
  const auto b = field::evaluate(*c.b, centers, field::Order::Gradient);
  double all = 0;
  const double limit = std::cos(15 * std::numbers::pi / 180);
  for (std::size_t t = 0; t < centers.size(); ++t) {
    if (beside[t] == 0) continue;
    all += areas[t];
    const double on_a = a.gradient(t).normalized().dot(normals[t]), on_b = turn * b.gradient(t).normalized().dot(normals[t]);
    if (std::max(on_a, on_b) < limit) f.wrong += areas[t];
  }
  f.wrong /= all;
  return f;
}

}  // namespace

int main(int argc, char** argv) {
  double voxel = 0.04;
  std::string json;
  for (int i = 1; i + 1 < argc; ++i) {
    if (std::string(argv[i]) == "--voxel") voxel = std::stod(argv[i + 1]);
    if (std::string(argv[i]) == "--json") json = argv[i + 1];
  }
  std::vector<Case> cases;
  std::vector<double> angles;
  for (const double degrees : {20.0, 30.0, 45.0, 60.0, 90.0})
    for (std::uint64_t kind = 0; kind < 3; ++kind) {
      cases.push_back(kind == 0   ? wedge(degrees, 3)
                      : kind == 1 ? balls(degrees, Join::Intersection, 4)
                                  : balls(degrees, Join::Difference, 5));
      angles.push_back(degrees);
    }
  cases.push_back(gyroid());
  angles.push_back(0);

  std::printf(
      "| edge | degrees | off, voxels: mean | 99 %% | most | facing wrong | genus | pieces | sound | triangles | s CPU |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|---|---|\n");
  nlohmann::json report = nlohmann::json::array();
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const auto edge = edge_points(cases[k]);
    const Figures f = measured(cases[k], edge, voxel);
    std::printf("| %s | %g | %.3f | %.3f | %.3f | %.1f %% | %lld | %lld | %s | %zu | %.2f |\n", cases[k].name.c_str(),
                angles[k], f.mean, f.p99, f.worst, 100 * f.wrong, f.genus, f.components, f.good ? "yes" : "NO", f.triangles,
                f.seconds);
    report.push_back({{"edge", cases[k].name},
                      {"degrees", angles[k]},
                      {"mean", f.mean},
                      {"p99", f.p99},
                      {"worst", f.worst},
                      {"wrong", f.wrong},
                      {"genus", f.genus},
                      {"components", f.components},
                      {"good", f.good},
                      {"seconds", f.seconds}});
  }
  if (!json.empty()) std::ofstream(json) << report.dump(1) << "\n";
}
