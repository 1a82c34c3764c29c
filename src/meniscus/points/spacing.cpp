#include <meniscus/points/spacing.h>

#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>

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

}  // namespace

double typical_spacing(const Cloud& cloud) {
  // Coincident points say nothing about spacing.
  std::vector<Vec3> distinct = cloud.positions;
  std::erase_if(distinct, [](const Vec3& p) { return !p.allFinite(); });
  const auto less = [](const Vec3& a, const Vec3& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::sort(distinct.begin(), distinct.end(), less);
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  if (distinct.size() < 2) return 0;

  const Adaptor adaptor{distinct};
  Tree tree(3, adaptor);
  tree.buildIndex();
  constexpr std::size_t kMost = 10'000;
  const std::size_t stride = std::max<std::size_t>(1, distinct.size() / kMost);
  std::vector<double> squared;
  for (std::size_t i = 0; i < distinct.size(); i += stride) {
    std::size_t index[2];
    double d2[2];
    if (tree.knnSearch(distinct[i].data(), 2, index, d2) == 2) squared.push_back(d2[1]);
  }
  const auto middle = squared.begin() + static_cast<std::ptrdiff_t>(squared.size() / 2);
  std::nth_element(squared.begin(), middle, squared.end());
  return std::sqrt(*middle);
}

}  // namespace meniscus::points
