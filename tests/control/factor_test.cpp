#include <meniscus/base/random.h>
#include <meniscus/control/factor.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <gtest/gtest.h>

namespace meniscus::control {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd random_matrix(std::uint64_t id, Eigen::Index rows, Eigen::Index columns) {
  MatrixXd a(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index k = 0; k < columns; ++k)
      a(i, k) = 2 * random_uniform(id, static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(k))[0] - 1;
  return a;
}

/// A matrix with singular values from 1 to 2 and zeros.
MatrixXd of_rank(Eigen::Index rows, Eigen::Index columns, Eigen::Index rank) {
  const MatrixXd u =
      Eigen::HouseholderQR<MatrixXd>(random_matrix(1, rows, rank)).householderQ() * MatrixXd::Identity(rows, rank);
  const MatrixXd v =
      Eigen::HouseholderQR<MatrixXd>(random_matrix(2, columns, rank)).householderQ() * MatrixXd::Identity(columns, rank);
  return u * VectorXd::LinSpaced(rank, 1, 2).asDiagonal() * v.transpose();
}

TEST(Factor, AnswersWithThePseudoinverseForEveryShapeRankAndMethod) {
  for (const auto& [rows, columns] :
       {std::pair{12, 12}, std::pair{9, 14}, std::pair{14, 9}, std::pair{6, 40}, std::pair{40, 6}})
    for (const int lost : {0, 2})
      for (const std::size_t dense_limit : {std::size_t{300}, std::size_t{0}}) {
        const int rank = std::min(rows, columns) - lost;
        const MatrixXd a = of_rank(rows, columns, rank);
        FactorOptions options;
        options.dense_limit = dense_limit;
        const Factor factor(a.sparseView(), options);
        if (lost == 0 || dense_limit > 0)
          EXPECT_EQ(factor.rank(), static_cast<std::size_t>(rank)) << rows << 'x' << columns << ' ' << dense_limit;
        else
          EXPECT_GE(factor.rank(), static_cast<std::size_t>(rank)) << "an estimate";
        EXPECT_GE(factor.condition(), 1);
        if (lost == 0 || dense_limit > 0) EXPECT_LE(factor.condition(), 100);
        const MatrixXd pseudo = a.completeOrthogonalDecomposition().pseudoInverse();
        // Where rank is lost a factor shifted by 1e-10 answers to about rounding over that shift.
        const double rounding = dense_limit == 0 ? 1e-5 : 1e-12;
        for (std::uint64_t k = 3; k < 6; ++k) {
          const VectorXd r = random_matrix(k, rows, 1);
          const Factor::Answer answer = factor.solve(r);
          EXPECT_LE((answer.y - pseudo * r).norm(), rounding) << rows << 'x' << columns << ' ' << rank;
          EXPECT_LE((answer.lambda - pseudo.transpose() * (pseudo * r)).norm(), rounding);
        }
      }
}

TEST(Factor, DampingShortensTheAnswer) {
  const MatrixXd a = of_rank(5, 8, 5);
  const VectorXd r = random_matrix(9, 5, 1);
  FactorOptions options;
  options.damping = 0.5;
  for (const std::size_t dense_limit : {std::size_t{300}, std::size_t{0}}) {
    options.dense_limit = dense_limit;
    const VectorXd y = a.transpose() * (a * a.transpose() + 0.25 * MatrixXd::Identity(5, 5)).inverse() * r;
    EXPECT_LE((Factor(a.sparseView(), options).solve(r).y - y).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace meniscus::control
