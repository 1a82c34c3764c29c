#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>
#include <meniscus/field/combine.h>
#include <meniscus/field/primitives.h>
#include <meniscus/points/neighbours.h>
#include <meniscus/pointset/boolean.h>
#include <meniscus/pointset/point_set_field.h>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>

namespace meniscus::pointset {
namespace {

constexpr std::size_t kBlock = 256;
constexpr double kCoincident = 0.01;  // spacings
constexpr std::size_t kNear = 6;      // neighbours whose mean distance is a point's spacing
constexpr double kNearEdge = 1.5;     // spacings: so near the other surface a point looks for the edge
constexpr double kWander = 3;         // spacings it may go
constexpr double kOnEdge = 1e-9;      // spacings
constexpr double kApart = 0.75;       // spacings between edge points, at least
constexpr double kParallel = 1e-3;    // sine of the angle below which the surfaces touch rather than cut
constexpr int kSteps = 30;

Vec3 vector_at(std::span<const double> values, std::size_t i) {
  return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
}

/// Mean distance of every point to its nearest few.
std::vector<double> spacings(const std::vector<Vec3>& p, const RunControl& run) {
  std::vector<double> s(p.size(), 0.0);
  const points::NeighbourSearch search(p);
  parallel_blocks(p.size(), kBlock, run, [&](std::size_t begin, std::size_t end) {
    std::vector<points::Neighbour> found;
    for (std::size_t i = begin; i < end; ++i) {
      search.nearest(p[i], kNear + 1, found);
      for (const points::Neighbour& n : found) s[i] += std::sqrt(n.squared_distance);
      if (found.size() > 1) s[i] /= static_cast<double>(found.size() - 1);
    }
  });
  return s;
}

/// One of the two surfaces, and what the other's field says at its points.
struct Side {
  const points::Cloud& cloud;
  std::span<const double> normals;
  std::vector<double> spacing;
  field::JetBatch other;  // value and gradient
};

Side side_of(const SurfacePoints& own, const SurfacePoints& other, const RunControl& run) {
  const auto normals = own.cloud.attributes.values(attribute::kNormal, 3);
  if (normals.size() != 3 * own.cloud.size()) throw InvalidInput("boolean: the points have no normals (attribute N)");
  return {own.cloud, normals, spacings(own.cloud.positions, run),
          field::evaluate(*other.field, own.cloud.positions, field::Order::Gradient, run)};
}

/// Whether the point belongs to the result's surface.
bool kept(const Side& side, std::size_t i, bool first, Operation operation) {
  const double s = side.other.value(i);
  if (std::abs(s) <= kCoincident * side.spacing[i]) {
    const bool agree = vector_at(side.normals, i).dot(side.other.gradient(i)) > 0;
    return first && agree == (operation != Operation::Difference);
  }
  switch (operation) {
    case Operation::Union: return s > 0;
    case Operation::Intersection: return s < 0;
    case Operation::Difference: return first ? s > 0 : s < 0;
  }
  return false;
}

std::vector<std::size_t> kept_points(const Side& side, bool first, Operation operation) {
  std::vector<std::size_t> list;
  for (std::size_t i = 0; i < side.cloud.size(); ++i)
    if (kept(side, i, first, operation)) list.push_back(i);
  return list;
}

struct EdgePoint {
  Vec3 position, normal_a, normal_b;
  double spacing = 0;
  bool found = false;
};

/// Brings points onto both surfaces: Newton's step of least length, x ← x − Jᵀ(JJᵀ)⁻¹ (s₁, s₂).
std::vector<EdgePoint> onto_both(const std::vector<Vec3>& starts, const std::vector<double>& spacing, const field::Field& fa,
                                 const field::Field& fb, const RunControl& run) {
  std::vector<EdgePoint> edge(starts.size());
  std::vector<Vec3> x = starts;
  std::vector<std::size_t> active(starts.size());
  for (std::size_t i = 0; i < active.size(); ++i) active[i] = i;
  for (int step = 0; step < kSteps && !active.empty(); ++step) {
    std::vector<Vec3> places;
    for (const std::size_t i : active) places.push_back(x[i]);
    const auto a = field::evaluate(fa, places, field::Order::Gradient, run);
    const auto b = field::evaluate(fb, places, field::Order::Gradient, run);
    std::vector<std::size_t> still;
    for (std::size_t k = 0; k < active.size(); ++k) {
      const std::size_t i = active[k];
      const Vec3 ga = a.gradient(k), gb = b.gradient(k);
      const Vec2 s(a.value(k), b.value(k));
      const double la = ga.norm(), lb = gb.norm(), c = ga.dot(gb);
      const double determinant = la * la * lb * lb - c * c;
      if (!(determinant > kParallel * kParallel * la * la * lb * lb)) continue;
      if (std::abs(s[0]) <= kOnEdge * spacing[i] * la && std::abs(s[1]) <= kOnEdge * spacing[i] * lb) {
        edge[i] = {x[i], ga / la, gb / lb, spacing[i], true};
        continue;
      }
      x[i] -= (lb * lb * s[0] - c * s[1]) / determinant * ga + (la * la * s[1] - c * s[0]) / determinant * gb;
      if ((x[i] - starts[i]).norm() <= kWander * spacing[i]) still.push_back(i);
    }
    active = std::move(still);
  }
  return edge;
}

/// Of points along the edge those that stand far enough from all taken before.
std::vector<EdgePoint> thinned(const std::vector<EdgePoint>& all) {
  std::vector<EdgePoint> found;
  for (const EdgePoint& e : all)
    if (e.found) found.push_back(e);
  std::vector<Vec3> p;
  for (const EdgePoint& e : found) p.push_back(e.position);
  const points::NeighbourSearch search(p);
  std::vector<bool> taken(found.size(), false);
  std::vector<EdgePoint> result;
  std::vector<points::Neighbour> near;
  for (std::size_t i = 0; i < found.size(); ++i) {
    search.within(p[i], kApart * found[i].spacing, near);
    if (std::any_of(near.begin(), near.end(), [&](const points::Neighbour& n) { return taken[n.index]; })) continue;
    taken[i] = true;
    result.push_back(found[i]);
  }
  return result;
}

std::vector<EdgePoint> edge_points(const Side& a, const Side& b, const field::Field& fa, const field::Field& fb,
                                   const RunControl& run) {
  std::vector<Vec3> starts;
  std::vector<double> spacing;
  for (const Side* side : {&a, &b})
    for (std::size_t i = 0; i < side->cloud.size(); ++i) {
      const double s = std::abs(side->other.value(i));
      if (!(s <= kNearEdge * side->spacing[i]) || !(side->spacing[i] > 0)) continue;
      starts.push_back(side->cloud.positions[i]);
      spacing.push_back(side->spacing[i]);
    }
  return thinned(onto_both(starts, spacing, fa, fb, run));
}

bool is_own(std::string_view name) { return name == attribute::kNormal || name == "N_a" || name == "N_b" || name == "part"; }

/// Attributes that both clouds have, of the points kept, then of the points `like` (of A).
void carry_attributes(const Side& a, const std::vector<std::size_t>& from_a, const Side& b,
                      const std::vector<std::size_t>& from_b, const std::vector<std::size_t>& like, Attributes& out) {
  for (const Attribute& x : a.cloud.attributes) {
    const Attribute* y = b.cloud.attributes.find(x.name);
    if (is_own(x.name) || y == nullptr || y->components != x.components || y->data.index() != x.data.index()) continue;
    std::visit(
        [&](const auto& values) {
          using Values = std::decay_t<decltype(values)>;
          const auto& others = std::get<Values>(y->data);
          Values joined;
          const auto take = [&](const Values& source, const std::vector<std::size_t>& indices) {
            for (const std::size_t i : indices)
              for (std::size_t c = 0; c < x.components; ++c) joined.push_back(source[i * x.components + c]);
          };
          take(values, from_a);
          take(others, from_b);
          take(values, like);
          if constexpr (std::is_same_v<Values, std::vector<double>>)
            out.set(x.name, x.components, std::move(joined));
          else
            out.set_integers(x.name, x.components, std::move(joined));
        },
        x.data);
  }
}

/// For every edge point the nearest point of A.
std::vector<std::size_t> nearest_of(const points::Cloud& a, const std::vector<EdgePoint>& edge) {
  std::vector<std::size_t> like;
  if (edge.empty()) return like;
  const points::NeighbourSearch search(a.positions);
  std::vector<points::Neighbour> found;
  for (const EdgePoint& e : edge) {
    search.nearest(e.position, 1, found);
    like.push_back(found.empty() ? 0 : found[0].index);
  }
  return like;
}

std::unique_ptr<field::Field> field_at(const Solid& solid, int depth) {
  if (depth > kMostNesting) throw InvalidInput("solid: nested more than " + std::to_string(kMostNesting) + " deep");
  if (!solid.operation) {
    if (!solid.set.empty()) return std::make_unique<PointSetField>(solid.set);
    field::Inputs nothing;  // what two balls have in common that do not touch
    for (const double x : {-2.0, 2.0}) nothing.push_back(field::sphere({x, 0, 0}, 1));
    return field::set_intersection(std::move(nothing));
  }
  field::Inputs inputs;
  for (const Solid& s : solid.inputs) inputs.push_back(field_at(s, depth + 1));
  switch (*solid.operation) {
    case Operation::Union: return field::set_union(std::move(inputs));
    case Operation::Intersection: return field::set_intersection(std::move(inputs));
    case Operation::Difference: return field::set_difference(std::move(inputs));
  }
  return nullptr;
}

}  // namespace

std::unique_ptr<field::Field> field_of(const Solid& solid) { return field_at(solid, 0); }

points::Cloud boolean(const SurfacePoints& a, const SurfacePoints& b, Operation operation, BooleanReport* report,
                      const RunControl& run) {
  const Side side_a = side_of(a, b, run), side_b = side_of(b, a, run);
  run.progress(0.6, "edge");
  const auto from_a = kept_points(side_a, true, operation), from_b = kept_points(side_b, false, operation);
  const auto edge = edge_points(side_a, side_b, *a.field, *b.field, run);

  points::Cloud result;
  std::vector<double> n, na, nb;
  std::vector<std::int64_t> part;
  const auto add = [&](const Vec3& p, const Vec3& normal, const Vec3& normal_a, const Vec3& normal_b, int which) {
    result.positions.push_back(p);
    n.insert(n.end(), normal.data(), normal.data() + 3);
    na.insert(na.end(), normal_a.data(), normal_a.data() + 3);
    nb.insert(nb.end(), normal_b.data(), normal_b.data() + 3);
    part.push_back(which);
  };
  const double turn = operation == Operation::Difference ? -1 : 1;
  for (const std::size_t i : from_a) {
    const Vec3 normal = vector_at(side_a.normals, i);
    add(a.cloud.positions[i], normal, normal, normal, 0);
  }
  for (const std::size_t i : from_b) {
    const Vec3 normal = turn * vector_at(side_b.normals, i);
    add(b.cloud.positions[i], normal, normal, normal, 1);
  }
  for (const EdgePoint& e : edge) {
    const Vec3 mean = e.normal_a + turn * e.normal_b;
    add(e.position, mean.norm() > kParallel ? Vec3(mean.normalized()) : e.normal_a, e.normal_a, turn * e.normal_b, 2);
  }
  carry_attributes(side_a, from_a, side_b, from_b, nearest_of(a.cloud, edge), result.attributes);
  result.attributes.set(attribute::kNormal, 3, std::move(n));
  result.attributes.set("N_a", 3, std::move(na));
  result.attributes.set("N_b", 3, std::move(nb));
  result.attributes.set_integers("part", 1, std::move(part));
  if (report != nullptr) *report = {from_a.size(), from_b.size(), edge.size()};
  run.progress(1);
  return result;
}

points::Cloud points_of(const Solid& solid, BooleanReport* report, const RunControl& run) {
  if (!solid.operation) return to_cloud(solid.set);
  const auto fa = field_of(solid.inputs.at(0)), fb = field_of(solid.inputs.at(1));
  return boolean({points_of(solid.inputs[0], nullptr, run), fa.get()}, {points_of(solid.inputs[1], nullptr, run), fb.get()},
                 *solid.operation, report, run);
}

}  // namespace meniscus::pointset
