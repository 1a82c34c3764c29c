#include <meniscus/points/spacing.h>

#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace meniscus::points {
namespace {

// What nanoflann asks of a point set.
struct Adaptor {
  const std::vector<Vec3>& points;
  std::size_t kdtree_get_point_count() const { return points.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][static_cast<Eigen::Index>(axis)]; }
  template <class B>
  bool kdtree_get_bbox(B&) const {
    return false;
  }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Adaptor>, Adaptor, 3, std::size_t>;

constexpr std::size_t kMost = 10'000;  // points that are asked

/// Finite and distinct: coincident points say nothing about spacing.
std::vector<Vec3> distinct_points(const Cloud& cloud) {
  std::vector<Vec3> distinct = cloud.positions;
  std::erase_if(distinct, [](const Vec3& p) { return !p.allFinite(); });
  const auto less = [](const Vec3& a, const Vec3& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::sort(distinct.begin(), distinct.end(), less);
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  return distinct;
}

/// Calls visit(d2) with the squared distances to the `count` nearest others, nearest first, for points spread over all of
/// them.
template <class Visit>
void visit_neighbours(const std::vector<Vec3>& points, std::size_t count, const Visit& visit) {
  const Adaptor adaptor{points};
  Tree tree(3, adaptor);
  tree.buildIndex();
  std::vector<std::size_t> index(count + 1);
  std::vector<double> d2(count + 1);
  for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(1, points.size() / kMost))
    if (tree.knnSearch(points[i].data(), count + 1, index.data(), d2.data()) == count + 1)
      visit(std::span<const double>(d2).subspan(1));
}

double quantile(std::vector<double>& values, std::size_t nth) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(nth);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double nearest_median(const std::vector<Vec3>& distinct) {
  if (distinct.size() < 2) return 0;
  std::vector<double> squared;
  visit_neighbours(distinct, 1, [&](std::span<const double> d2) { squared.push_back(d2[0]); });
  return std::sqrt(quantile(squared, squared.size() / 2));
}

}  // namespace

double typical_spacing(const Cloud& cloud) { return nearest_median(distinct_points(cloud)); }

double bulk_spacing(const Cloud& cloud) {
  constexpr std::size_t kFirst = 9, kLast = 20;
  constexpr double kDisorder = 1.8;  // nearest neighbours of a Poisson process stand at 0.554 of the spacing
  const std::vector<Vec3> points = distinct_points(cloud);
  const double nearest = nearest_median(points);
  if (points.size() <= kLast) return nearest;
  std::vector<double> spacing;
  visit_neighbours(points, kLast, [&](std::span<const double> d2) {
    double sum = 0;  // a ball that reaches to the middle of the k-th neighbour holds k + 1/2 points
    for (std::size_t k = kFirst; k <= kLast; ++k)
      sum += std::sqrt(d2[k - 1]) * std::cbrt(4 * std::numbers::pi / 3 / (static_cast<double>(k) + 0.5));
    spacing.push_back(sum / (kLast - kFirst + 1));
  });
  return std::min(quantile(spacing, spacing.size() / 10), kDisorder * nearest);
}

}  // namespace meniscus::points
