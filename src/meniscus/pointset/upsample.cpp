#include <meniscus/pointset/upsample.h>

#include <meniscus/base/parallel.h>
#include <meniscus/pointset/local_fit.h>
#include <meniscus/pointset/point_set_field.h>
#include <meniscus/pointset/tangent_cell.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace meniscus::pointset {
namespace {

constexpr std::size_t kBlock = 32;
constexpr std::size_t kNeighbours = 20;  // that bound a cell
constexpr double kOwn = 0.4;             // reach: about a cloud's own spacing
constexpr double kRadius = 0.8;          // spacings: half a square's diagonal, and some
constexpr double kOverlap = 0.5;         // spacings by which neighbouring tilings overlap, or a seam could open
constexpr double kBend = 0.1;            // of a cell's radius: the same, because cells of bent surfaces do not fit
constexpr double kOn = 1e-4;             // spacings
constexpr int kSteps = 8;
constexpr int kEdgeSteps = 4;

/// What is known of a point's cell.
struct Cell {
  double area = 0, perimeter = 0, radius = 0;
  double spacing = 0;  ///< of its samples
  double own = 0;      ///< widest spacing
  bool there = true;   ///< some of it may be on the solid's surface

  /// No fewer than the samples there will be: points of a lattice in a convex polygon, grown on all sides.
  double samples() const {
    if (!there) return 0;
    const double m = margin(), grown = area + perimeter * m + 4 * m * m;
    return grown / (spacing * spacing) + (perimeter + 8 * m) / (2 * spacing) + 1;
  }
  double margin() const { return kOverlap * spacing + kBend * radius; }
};

/// One cloud of the solid.
struct Leaf {
  Leaf(const PointSet& points, double side) : set(points), turn(side), field(points), search(positions(points)) {}

  const PointSet& set;
  double turn;  ///< -1 where its inside is the solid's outside
  PointSetField field;
  points::NeighbourSearch search;
  std::vector<Cell> cells;
};

void collect(const Solid& solid, double turn, std::vector<std::unique_ptr<Leaf>>& leaves) {
  if (!solid.operation) {
    if (!solid.set.empty()) leaves.push_back(std::make_unique<Leaf>(solid.set, turn));
    return;
  }
  collect(solid.inputs.at(0), turn, leaves);
  collect(solid.inputs.at(1), *solid.operation == Operation::Difference ? -turn : turn, leaves);
}

double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

void find_cell(const Leaf& leaf, std::size_t i, std::vector<points::Neighbour>& near, std::vector<Vec2>& corners) {
  leaf.search.nearest(leaf.set.position(i), kNeighbours + 1, near);
  tangent_cell(leaf.set, i, near, leaf.set.reach[i], corners);
}

Cell measured(const std::vector<Vec2>& corners) {
  Cell cell;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Vec2 &a = corners[k], &b = corners[(k + 1) % corners.size()];
    cell.area += 0.5 * cross(a, b);
    cell.perimeter += (b - a).norm();
    cell.radius = std::max(cell.radius, a.norm());
  }
  return cell;
}

/// A point's samples are as near as the nearest wanted about it: what faces away may be seen past an edge.
void measure_cells(Leaf& leaf, const field::Field* whole, SpacingAt spacing, const RunControl& run) {
  const std::size_t count = leaf.set.size();
  std::vector<double> wanted(count);
  parallel_for(count, kBlock, run, [&](std::size_t i) {
    wanted[i] = std::min(spacing(leaf.set.position(i), leaf.turn * leaf.set.normal(i)), kOwn * leaf.set.reach[i]);
  });
  leaf.cells.resize(count);
  parallel_blocks(count, kBlock, run, [&](std::size_t begin, std::size_t end) {
    std::vector<points::Neighbour> near;
    std::vector<Vec2> corners;
    for (std::size_t i = begin; i < end; ++i) {
      find_cell(leaf, i, near, corners);
      leaf.cells[i] = measured(corners);
      leaf.cells[i].own = kOwn * leaf.set.reach[i];
      leaf.cells[i].spacing = wanted[i];
      for (const points::Neighbour& n : near) leaf.cells[i].spacing = std::min(leaf.cells[i].spacing, wanted[n.index]);
    }
  });
  if (whole == nullptr) return;
  const auto values = field::evaluate(*whole, positions(leaf.set), field::Order::Value, run);
  for (std::size_t i = 0; i < count; ++i) leaf.cells[i].there = std::abs(values.value(i)) <= leaf.set.reach[i];
}

/// Widens all spacings, up to the clouds' own, until the samples are no more than `most`; the factor.
double widen(std::vector<std::unique_ptr<Leaf>>& leaves, std::size_t most) {
  double factor = 1;
  for (int round = 0; round < 100; ++round) {
    double samples = 0;
    bool can = false;
    for (const auto& leaf : leaves)
      for (const Cell& c : leaf->cells) {
        samples += c.samples();
        can = can || (c.there && c.spacing < c.own);
      }
    if (samples <= static_cast<double>(most) || !can) break;
    const double wider = std::max(1.02, std::sqrt(samples / static_cast<double>(std::max<std::size_t>(most, 1))));
    factor *= wider;
    for (auto& leaf : leaves)
      for (Cell& c : leaf->cells) c.spacing = std::min(wider * c.spacing, c.own);
  }
  return factor;
}

/// Calls visit for every corner of the tiling that lies in the cell or less than its margin beyond.
template <class Visit>
void for_corners(const std::vector<Vec2>& corners, const Cell& cell, const Visit& visit) {
  const auto inside = [&](const Vec2& q) {
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Vec2 &a = corners[k], side = corners[(k + 1) % corners.size()] - a;
      if (cross(side, q - a) < -cell.margin() * side.norm()) return false;
    }
    return true;
  };
  Vec2 low = Vec2::Zero(), high = Vec2::Zero();
  for (const Vec2& c : corners) low = low.cwiseMin(c), high = high.cwiseMax(c);
  const double h = cell.spacing;
  const auto first = [&](double x) { return static_cast<long>(std::floor((x - cell.margin()) / h)); };
  const auto last = [&](double x) { return static_cast<long>(std::ceil((x + cell.margin()) / h)); };
  for (long a = first(low.x()); a <= last(high.x()); ++a)
    for (long b = first(low.y()); b <= last(high.y()); ++b) {
      const Vec2 q(static_cast<double>(a) * h, static_cast<double>(b) * h);
      if ((a == 0 && b == 0) || inside(q)) visit(q);
    }
}

struct Sample {
  Vec3 place, normal;
  std::size_t like = 0;  ///< the point whose cell it is in
  double spacing = 0;
};

/// Drops the samples that `keep(k, sample)` does not want.
template <class Keep>
void retain(std::vector<Sample>& samples, const Keep& keep) {
  std::size_t kept = 0;
  for (std::size_t k = 0; k < samples.size(); ++k)
    if (keep(k, samples[k])) samples[kept++] = samples[k];
  samples.resize(kept);
}

field::PositionBatch places_of(const std::vector<Sample>& samples) {
  field::PositionBatch x(samples.size());
  for (std::size_t k = 0; k < samples.size(); ++k) x.set(k, samples[k].place);
  return x;
}

field::JetBatch jets_of(const field::Field& f, const std::vector<Sample>& samples) {
  field::JetBatch jets(samples.size(), field::Order::Gradient);
  f.evaluate(places_of(samples).view(), jets.view());
  return jets;
}

/// Drops samples where there is no surface: in no domain, or beyond an open border.
void drop_uncovered(const Leaf& leaf, std::vector<Sample>& samples) {
  std::vector<std::uint8_t> covered(samples.size());
  leaf.field.covers(places_of(samples).view(), covered);
  retain(samples, [&](std::size_t k, const Sample&) { return covered[k] != 0; });
}

/// Newton's method along ∇F; samples that do not arrive within a domain are dropped. Sets their normals.
void bring_onto(const Leaf& leaf, std::vector<Sample>& samples) {
  std::vector<std::uint8_t> there(samples.size(), 0);
  for (int step = 0; step <= kSteps; ++step) {
    const field::JetBatch jets = jets_of(leaf.field, samples);
    bool all = true;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      if (there[k] != 0) continue;
      const Vec3 g = jets.gradient(k);
      const double length = g.norm();
      if (!(length > 0)) continue;
      samples[k].normal = g / length;
      const double away = jets.value(k) / length;
      there[k] = std::abs(away) <= kOn * samples[k].spacing ? 1 : 0;
      if (there[k] == 0) samples[k].place -= away * samples[k].normal;
      all = all && there[k] != 0;
    }
    if (all) break;
  }
  retain(samples, [&](std::size_t k, const Sample& s) {
    return there[k] != 0 && (s.place - leaf.set.position(s.like)).norm() <= leaf.set.reach[s.like];
  });
}

/// Of samples on the leaf those on the solid's surface; those less than a spacing beyond its edge are brought back to it.
void cut_at_edges(const Leaf& leaf, const field::Field& whole, std::vector<Sample>& samples) {
  for (int step = 0; step <= kEdgeSteps; ++step) {
    const field::JetBatch jets = jets_of(whole, samples);
    const bool last = step == kEdgeSteps;
    std::vector<Vec3> moves(samples.size(), Vec3::Zero());
    std::vector<std::uint8_t> keep(samples.size(), 0);
    bool moved = false;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const double s = jets.value(k), h = samples[k].spacing;
      keep[k] = std::abs(s) <= 10 * kOn * h ? 1 : 0;
      if (keep[k] != 0 || last) continue;
      const Vec3 n = samples[k].normal, g = jets.gradient(k), along = g - g.dot(n) * n;
      moves[k] = s / along.squaredNorm() * along;
      keep[k] = moves[k].norm() <= h ? 1 : 0;  // false where it is not finite
      moved = moved || keep[k] != 0;
    }
    for (std::size_t k = 0; k < samples.size(); ++k)
      if (keep[k] != 0) samples[k].place -= moves[k];
    retain(samples, [&](std::size_t k, const Sample&) { return keep[k] != 0; });
    if (!moved) return;
    bring_onto(leaf, samples);
  }
}

std::vector<Sample> samples_of(const Leaf& leaf, const field::Field* whole, std::size_t begin, std::size_t end) {
  std::vector<Sample> samples;
  std::vector<points::Neighbour> near;
  std::vector<Vec2> corners;
  for (std::size_t i = begin; i < end; ++i) {
    if (!leaf.cells[i].there) continue;
    find_cell(leaf, i, near, corners);
    const Frame frame = frame_about(leaf.set.normal(i));
    for_corners(corners, leaf.cells[i], [&](const Vec2& q) {
      samples.push_back({leaf.set.position(i) + q.x() * frame.u + q.y() * frame.v, frame.w, i, leaf.cells[i].spacing});
    });
  }
  drop_uncovered(leaf, samples);
  bring_onto(leaf, samples);
  drop_uncovered(leaf, samples);
  if (whole != nullptr) cut_at_edges(leaf, *whole, samples);
  return samples;
}

/// Weights of the leaf's points around the samples, normalised, that blend attributes as the field blends splines.
class Blend {
 public:
  Blend(const Leaf& leaf, const std::vector<Sample>& samples) : samples_(samples) {
    std::vector<points::Neighbour> near;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const std::size_t i = samples[k].like;
      if (k == 0 || i != samples[k - 1].like) leaf.search.nearest(leaf.set.position(i), kNeighbours + 1, near);
      const double reach = 0.6 * leaf.set.reach[i], first = static_cast<double>(terms_.size());
      double sum = 0;
      for (const points::Neighbour& n : near) {
        const double t = (samples[k].place - leaf.set.position(n.index)).squaredNorm() / (reach * reach);
        if (t < 1) terms_.emplace_back(n.index, (1 - t) * (1 - t) * (1 - t));
      }
      for (auto t = static_cast<std::size_t>(first); t < terms_.size(); ++t) sum += terms_[t].second;
      if (!(sum > 0)) terms_.emplace_back(i, sum = 1);
      for (auto t = static_cast<std::size_t>(first); t < terms_.size(); ++t) terms_[t].second /= sum;
      end_.push_back(terms_.size());
    }
  }

  std::vector<double> operator()(const std::vector<double>& values, std::size_t components) const {
    std::vector<double> out(components * samples_.size(), 0.0);
    for (std::size_t k = 0, t = 0; k < samples_.size(); ++k)
      for (; t < end_[k]; ++t)
        for (std::size_t c = 0; c < components; ++c)
          out[components * k + c] += terms_[t].second * values[components * terms_[t].first + c];
    return out;
  }
  std::vector<std::int64_t> operator()(const std::vector<std::int64_t>& values, std::size_t components) const {
    std::vector<std::int64_t> out;
    for (const Sample& s : samples_)
      for (std::size_t c = 0; c < components; ++c) out.push_back(values[components * s.like + c]);
    return out;
  }

 private:
  const std::vector<Sample>& samples_;
  std::vector<std::pair<std::size_t, double>> terms_;
  std::vector<std::size_t> end_;
};

bool same_kind(const Attribute& a, const Attribute* b) {
  return b != nullptr && a.components == b->components && a.data.index() == b->data.index();
}

/// The attributes that all leaves have, without values.
Attributes shared_attributes(const std::vector<std::unique_ptr<Leaf>>& leaves) {
  Attributes shared;
  if (leaves.empty()) return shared;
  for (const Attribute& a : leaves[0]->set.attributes) {
    const bool everywhere = std::all_of(leaves.begin(), leaves.end(),
                                        [&](const auto& leaf) { return same_kind(a, leaf->set.attributes.find(a.name)); });
    if (!everywhere || a.name == attribute::kNormal || a.name == attribute::kRadius) continue;
    if (a.is_integer())
      shared.set_integers(a.name, a.components, {});
    else
      shared.set(a.name, a.components, {});
  }
  return shared;
}

points::Cloud cloud_of(const Leaf& leaf, const std::vector<Sample>& samples, const Attributes& shared) {
  points::Cloud cloud;
  std::vector<double> normals, radii;
  for (const Sample& s : samples) {
    cloud.positions.push_back(s.place);
    const Vec3 n = leaf.turn * s.normal;
    normals.insert(normals.end(), n.data(), n.data() + 3);
    radii.push_back(kRadius * s.spacing);
  }
  cloud.attributes.set(attribute::kNormal, 3, std::move(normals));
  cloud.attributes.set(attribute::kRadius, 1, std::move(radii));
  if (shared.empty()) return cloud;
  const Blend blend(leaf, samples);
  for (const Attribute& a : shared) {
    const Attribute& source = *leaf.set.attributes.find(a.name);
    if (a.is_integer())
      cloud.attributes.set_integers(a.name, a.components, blend(std::get<1>(source.data), a.components));
    else
      cloud.attributes.set(a.name, a.components, blend(std::get<0>(source.data), a.components));
  }
  return cloud;
}

points::Cloud joined(std::vector<points::Cloud>& parts, const Attributes& shared) {
  points::Cloud all;
  const auto append = [&](const Attribute& a) {
    const auto gather = [&](auto values) {
      for (const points::Cloud& part : parts) {
        const auto& more = std::get<decltype(values)>(part.attributes.find(a.name)->data);
        values.insert(values.end(), more.begin(), more.end());
      }
      return values;
    };
    if (a.is_integer())
      all.attributes.set_integers(a.name, a.components, gather(std::vector<std::int64_t>()));
    else
      all.attributes.set(a.name, a.components, gather(std::vector<double>()));
  };
  for (const points::Cloud& part : parts)
    all.positions.insert(all.positions.end(), part.positions.begin(), part.positions.end());
  append({std::string(attribute::kNormal), 3, std::vector<double>()});
  append({std::string(attribute::kRadius), 1, std::vector<double>()});
  for (const Attribute& a : shared) append(a);
  return all;
}

}  // namespace

points::Cloud upsample(const Solid& solid, SpacingAt spacing, std::size_t most, UpsampleReport* report,
                       const RunControl& run) {
  std::vector<std::unique_ptr<Leaf>> leaves;
  collect(solid, 1, leaves);
  const std::unique_ptr<field::Field> whole = solid.operation ? field_of(solid) : nullptr;
  for (auto& leaf : leaves) measure_cells(*leaf, whole.get(), spacing, run);
  const double factor = widen(leaves, most);
  if (report != nullptr) report->coarser = factor;

  const Attributes shared = shared_attributes(leaves);
  std::vector<points::Cloud> parts;
  for (const auto& leaf : leaves) {
    const std::size_t first = parts.size(), count = leaf->set.size();
    parts.resize(first + (count + kBlock - 1) / kBlock);
    parallel_blocks(count, kBlock, run, [&](std::size_t begin, std::size_t end) {
      parts[first + begin / kBlock] = cloud_of(*leaf, samples_of(*leaf, whole.get(), begin, end), shared);
    });
  }
  return joined(parts, shared);
}

}  // namespace meniscus::pointset
