#include <meniscus/motion/strain_factor.h>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>

#include <cmath>

namespace meniscus::motion {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Block = Eigen::Matrix2f;

}  // namespace

struct StrainFactor::State {
  std::vector<Eigen::Index> place;  // of each vertex in the order of elimination
  Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>> factor;
  bool ready = false;
  // L = I + blocks below the diagonal, column by column, and D⁻¹; the diagonal blocks of L have one number each.
  std::vector<std::size_t> begin;
  std::vector<std::int32_t> row;
  std::vector<Block> below;
  std::vector<float> corner;
  std::vector<Eigen::Vector2f> pivot;

  Sparse matrix(const std::vector<Strain>& strains, double guide) const;
  bool keep();
};

StrainFactor::StrainFactor() : state_(std::make_unique<State>()) {}
StrainFactor::~StrainFactor() = default;
StrainFactor::StrainFactor(StrainFactor&&) noexcept = default;
StrainFactor& StrainFactor::operator=(StrainFactor&&) noexcept = default;

bool StrainFactor::ready() const { return state_->ready; }

void StrainFactor::analyse(const std::vector<Triangle>& triangles, std::size_t vertices) {
  std::vector<Eigen::Triplet<double>> entries;
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      entries.emplace_back(t[k], t[(k + 1) % 3], 1);
      entries.emplace_back(t[(k + 1) % 3], t[k], 1);
    }
  const auto size = static_cast<Eigen::Index>(vertices);
  for (Eigen::Index i = 0; i < size; ++i) entries.emplace_back(i, i, 1);
  Sparse graph(size, size);
  graph.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int>()(graph.selfadjointView<Eigen::Lower>(), order);
  state_->place.resize(vertices);
  for (Eigen::Index i = 0; i < size; ++i) state_->place[static_cast<std::size_t>(order.indices()[i])] = i;
}

/// Its lower triangle, in the order of elimination. Entries of all four pairs of a block are there, zero or not.
Sparse StrainFactor::State::matrix(const std::vector<Strain>& strains, double guide) const {
  const auto size = static_cast<Eigen::Index>(2 * place.size());
  std::vector<double> stiffness(place.size());
  for (const Strain& s : strains)
    for (std::size_t k = 0; k < 3; ++k)
      stiffness[static_cast<std::size_t>(s.corner[k])] +=
          s.weight * s.rows.middleCols<2>(2 * static_cast<Eigen::Index>(k)).squaredNorm() / 2;
  const auto unknown = [&](const Strain& s, Eigen::Index i) {
    return 2 * place[static_cast<std::size_t>(s.corner[static_cast<std::size_t>(i / 2)])] + i % 2;
  };
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(21 * strains.size() + 3 * place.size());
  for (std::size_t i = 0; i < place.size(); ++i) {
    const double weight = stiffness[i] > 0 ? guide * stiffness[i] : 1;  // 1: a vertex that nothing holds
    entries.emplace_back(2 * place[i], 2 * place[i], weight);
    entries.emplace_back(2 * place[i] + 1, 2 * place[i], 0);
    entries.emplace_back(2 * place[i] + 1, 2 * place[i] + 1, weight);
  }
  for (const Strain& s : strains) {
    const Eigen::Matrix<double, 6, 6> block = s.weight * s.rows.transpose() * s.rows;
    for (Eigen::Index i = 0; i < 6; ++i)
      for (Eigen::Index j = 0; j < 6; ++j) {
        const Eigen::Index a = unknown(s, i);
        const Eigen::Index b = unknown(s, j);
        if (a >= b) entries.emplace_back(a, b, block(i, j));
      }
  }
  Sparse result(size, size);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

bool StrainFactor::factorise(const std::vector<Strain>& strains, double guide) {
  State& s = *state_;
  s.factor.compute(s.matrix(strains, guide));
  s.ready = s.factor.info() == Eigen::Success && s.keep();
  return s.ready;
}

/// Copies the factors into blocks. Elimination fills whole blocks, so both columns of a vertex have the same rows.
bool StrainFactor::State::keep() {
  const Sparse l = factor.matrixL();
  const Eigen::VectorXd d = factor.vectorD();
  begin.assign(1, 0);
  row.clear();
  below.clear();
  corner.clear();
  pivot.clear();
  for (Eigen::Index j = 0; j < l.cols(); j += 2) {
    Sparse::InnerIterator left(l, j);
    Sparse::InnerIterator right(l, j + 1);
    float below_pivot = 0;
    while (left && left.row() <= j + 1) {
      if (left.row() == j + 1) below_pivot = static_cast<float>(left.value());
      ++left;
    }
    while (right && right.row() <= j + 1) ++right;
    while (left && right) {
      Block b;
      row.push_back(static_cast<std::int32_t>(left.row() / 2));
      for (Eigen::Index r = 0; r < 2; ++r, ++left, ++right) {
        if (!left || !right || left.row() != right.row() || left.row() % 2 != r) return false;
        b(r, 0) = static_cast<float>(left.value());
        b(r, 1) = static_cast<float>(right.value());
      }
      below.push_back(b);
    }
    begin.push_back(row.size());
    corner.push_back(below_pivot);
    pivot.emplace_back(static_cast<float>(1 / d[j]), static_cast<float>(1 / d[j + 1]));
    if (!pivot.back().allFinite()) return false;
  }
  return true;
}

Strain::Vector StrainFactor::solve(const Strain::Vector& right) const {
  const State& s = *state_;
  const std::size_t n = s.place.size();
  // Single precision has less range than what is solved for.
  const double scale = right.cwiseAbs().maxCoeff();
  Strain::Vector result = Strain::Vector::Zero(right.size());
  if (!(scale > 0) || !std::isfinite(scale)) return result;
  std::vector<Eigen::Vector2f> x(n);
  for (std::size_t i = 0; i < n; ++i)
    x[static_cast<std::size_t>(s.place[i])] = (right.segment<2>(2 * static_cast<Eigen::Index>(i)) / scale).cast<float>();
  for (std::size_t j = 0; j < n; ++j) {
    x[j].y() -= s.corner[j] * x[j].x();
    const Eigen::Vector2f y = x[j];
    for (std::size_t k = s.begin[j]; k < s.begin[j + 1]; ++k) x[static_cast<std::size_t>(s.row[k])] -= s.below[k] * y;
  }
  for (std::size_t j = n; j-- > 0;) {
    Eigen::Vector2f y = x[j].cwiseProduct(s.pivot[j]);
    for (std::size_t k = s.begin[j]; k < s.begin[j + 1]; ++k)
      y -= s.below[k].transpose() * x[static_cast<std::size_t>(s.row[k])];
    y.x() -= s.corner[j] * y.y();
    x[j] = y;
  }
  for (std::size_t i = 0; i < n; ++i)
    result.segment<2>(2 * static_cast<Eigen::Index>(i)) = scale * x[static_cast<std::size_t>(s.place[i])].cast<double>();
  return result;
}

}  // namespace meniscus::motion
