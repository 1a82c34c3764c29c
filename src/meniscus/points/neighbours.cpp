#include <meniscus/points/neighbours.h>

#include <meniscus/base/error.h>
#include <meniscus/base/parallel.h>

#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace meniscus::points {

namespace {

constexpr std::size_t kBlock = 256;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool nearer(const Neighbour& a, const Neighbour& b) {
  return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance : a.index < b.index;
}

/// The tree skips what lies beyond the farthest answer. A little more is let through: its own bounds are rounded, and of
/// points at one distance the lower index must win.
double with_slack(double squared_distance) { return squared_distance * (1 + 1e-12) + std::numeric_limits<double>::min(); }

/// The finite points, as nanoflann wants to see them.
struct Points {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> index;

  std::size_t kdtree_get_point_count() const { return positions.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const { return positions[i][static_cast<Eigen::Index>(axis)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

/// Collects the `count` nearest: a heap with the farthest on top.
class Nearest {
 public:
  Nearest(const Points& points, std::size_t count, std::vector<Neighbour>& found)
      : points_(points), count_(count), found_(found) {}

  bool addPoint(double squared_distance, std::size_t i) {  // NOLINT(readability-identifier-naming): nanoflann's names
    const Neighbour n{points_.index[i], squared_distance};
    if (found_.size() == count_) {
      if (!nearer(n, found_.front())) return true;
      std::pop_heap(found_.begin(), found_.end(), nearer);
      found_.back() = n;
    } else {
      found_.push_back(n);
    }
    std::push_heap(found_.begin(), found_.end(), nearer);
    return true;
  }
  double worstDist() const {  // NOLINT(readability-identifier-naming)
    return found_.size() < count_ ? kInfinity : with_slack(found_.front().squared_distance);
  }
  bool full() const { return found_.size() == count_; }
  std::size_t size() const { return found_.size(); }

 private:
  const Points& points_;
  std::size_t count_;
  std::vector<Neighbour>& found_;
};

/// Collects all within a radius.
class Within {
 public:
  Within(const Points& points, double squared_radius, std::vector<Neighbour>& found)
      : points_(points), squared_radius_(squared_radius), found_(found) {}

  bool addPoint(double squared_distance, std::size_t i) {  // NOLINT(readability-identifier-naming)
    if (squared_distance <= squared_radius_) found_.push_back({points_.index[i], squared_distance});
    return true;
  }
  double worstDist() const { return with_slack(squared_radius_); }  // NOLINT(readability-identifier-naming)
  bool full() const { return true; }
  std::size_t size() const { return found_.size(); }

 private:
  const Points& points_;
  double squared_radius_;
  std::vector<Neighbour>& found_;
};

Points finite_points(std::span<const Vec3> points) {
  if (points.size() > std::numeric_limits<std::uint32_t>::max())
    throw ResourceLimit("neighbour search: " + std::to_string(points.size()) + " points are more than 2^32 - 1");
  Points result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite()) continue;
    result.positions.push_back(points[i]);
    result.index.push_back(static_cast<std::uint32_t>(i));
  }
  return result;
}

}  // namespace

struct NeighbourSearch::Tree {
  using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>, Points, 3, std::uint32_t>;

  explicit Tree(std::span<const Vec3> p) : points(finite_points(p)), index(3, points, {10}) {}

  template <class Result>
  void search(const Vec3& place, Result result, std::vector<Neighbour>& found) const {
    if (points.positions.empty() || !place.allFinite()) return;
    index.findNeighbors(result, place.data(), nanoflann::SearchParams());
    std::sort(found.begin(), found.end(), nearer);
  }

  Points points;
  Index index;
};

NeighbourSearch::NeighbourSearch(std::span<const Vec3> points) : tree_(std::make_unique<Tree>(points)) {}
NeighbourSearch::~NeighbourSearch() = default;
NeighbourSearch::NeighbourSearch(NeighbourSearch&&) noexcept = default;
NeighbourSearch& NeighbourSearch::operator=(NeighbourSearch&&) noexcept = default;

void NeighbourSearch::nearest(const Vec3& place, std::size_t count, std::vector<Neighbour>& result) const {
  result.clear();
  if (count > 0) tree_->search(place, Nearest(tree_->points, count, result), result);
}

void NeighbourSearch::within(const Vec3& place, double radius, std::vector<Neighbour>& result) const {
  result.clear();
  if (radius >= 0) tree_->search(place, Within(tree_->points, radius * radius, result), result);
}

namespace {

/// Lists of the answers to ask(point, answers) without the point itself, at most `most` of each.
template <class Ask>
NeighbourLists lists(std::span<const Vec3> points, std::size_t most, const RunControl& run, const Ask& ask) {
  std::vector<std::vector<std::uint32_t>> found((points.size() + kBlock - 1) / kBlock);  // one per block
  NeighbourLists result;
  result.begin.assign(points.size() + 1, 0);
  parallel_blocks(points.size(), kBlock, run, [&](std::size_t begin, std::size_t end) {
    std::vector<Neighbour> answers;
    std::vector<std::uint32_t>& list = found[begin / kBlock];
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t before = list.size();
      ask(points[i], answers);
      for (const Neighbour& n : answers)
        if (n.index != i && list.size() - before < most) list.push_back(n.index);
      result.begin[i + 1] = list.size() - before;
    }
  });
  for (std::size_t i = 0; i < points.size(); ++i) result.begin[i + 1] += result.begin[i];
  result.index.reserve(result.begin.back());
  for (const auto& list : found) result.index.insert(result.index.end(), list.begin(), list.end());
  return result;
}

}  // namespace

NeighbourLists nearest_neighbours(std::span<const Vec3> points, std::size_t count, const RunControl& run) {
  const NeighbourSearch search(points);
  // One more than wanted: the point itself is usually among them.
  return lists(points, count, run, [&](const Vec3& p, std::vector<Neighbour>& answers) {
    search.nearest(p, count == std::numeric_limits<std::size_t>::max() ? count : count + 1, answers);
  });
}

NeighbourLists neighbours_within(std::span<const Vec3> points, double radius, const RunControl& run) {
  if (!(radius >= 0)) throw InvalidInput("neighbours: the radius must not be negative");
  const NeighbourSearch search(points);
  return lists(points, points.size(), run,
               [&](const Vec3& p, std::vector<Neighbour>& answers) { search.within(p, radius, answers); });
}

}  // namespace meniscus::points
