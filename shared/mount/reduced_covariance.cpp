// SPDX-License-Identifier: Apache-2.0
#include "mount/reduced_covariance.hpp"

#include <ceres/crs_matrix.h>
#include <ceres/problem.h>

#include <Eigen/Dense>
#include <Eigen/SparseCore>

#include <algorithm>

namespace crane {

Eigen::MatrixXd reduced_covariance(ceres::Problem& problem, const std::vector<double*>& wanted,
                                   const std::vector<double*>& eliminated) {
  // Columns: the wanted ones, all others that stay, then the eliminated ones.
  ceres::Problem::EvaluateOptions options;
  std::vector<double*> blocks, others;
  const auto takes_part = [&](double* block) { return !problem.IsParameterBlockConstant(block); };
  Eigen::Index all = 0;
  for (double* block : wanted) {
    all += problem.ParameterBlockTangentSize(block);
    if (takes_part(block)) options.parameter_blocks.push_back(block);
  }
  const auto is_in = [](const std::vector<double*>& sorted, double* block) {
    return std::binary_search(sorted.begin(), sorted.end(), block);
  };
  std::vector<double*> named = wanted;
  named.insert(named.end(), eliminated.begin(), eliminated.end());
  std::sort(named.begin(), named.end());
  problem.GetParameterBlocks(&blocks);
  for (double* block : blocks)
    if (!is_in(named, block) && takes_part(block)) options.parameter_blocks.push_back(block);
  Eigen::Index kept = 0;
  for (double* block : options.parameter_blocks) kept += problem.ParameterBlockTangentSize(block);
  options.parameter_blocks.insert(options.parameter_blocks.end(), eliminated.begin(),
                                  eliminated.end());
  ceres::CRSMatrix crs;
  problem.Evaluate(options, nullptr, nullptr, nullptr, &crs);
  const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> J(
      crs.num_rows, crs.num_cols, static_cast<Eigen::Index>(crs.values.size()), crs.rows.data(),
      crs.cols.data(), crs.values.data());
  const Eigen::SparseMatrix<double> columns = J;
  const Eigen::SparseMatrix<double> H = columns.transpose() * columns;
  Eigen::MatrixXd S = Eigen::MatrixXd(H.topLeftCorner(kept, kept));
  for (Eigen::Index p = kept; p + 3 <= H.cols(); p += 3) {
    Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
    std::vector<Eigen::Index> rows;
    Eigen::MatrixXd across(64, 3);
    for (int k = 0; k < 3; ++k)
      for (Eigen::SparseMatrix<double>::InnerIterator it(H, p + k); it; ++it) {
        if (it.row() >= kept) {
          if (it.row() >= p && it.row() < p + 3) own(it.row() - p, k) = it.value();
          continue;
        }
        const auto at = std::lower_bound(rows.begin(), rows.end(), it.row());
        auto i = at - rows.begin();
        if (at == rows.end() || *at != it.row()) {
          if (Eigen::Index(rows.size()) == across.rows())
            across.conservativeResize(2 * across.rows(), 3);
          for (Eigen::Index r = Eigen::Index(rows.size()); r > i; --r)
            across.row(r) = across.row(r - 1);
          across.row(i).setZero();
          rows.insert(at, it.row());
        }
        across(i, k) = it.value();
      }
    own.diagonal().array() *= 1 + 1e-12;
    const auto n = Eigen::Index(rows.size());
    const Eigen::MatrixXd told = across.topRows(n) * own.inverse();
    const Eigen::MatrixXd minus = told * across.topRows(n).transpose();
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < n; ++j) S(rows[i], rows[j]) -= minus(i, j);
  }
  // Scaled by its diagonal: metres and radians differ.
  const Eigen::VectorXd scale = S.diagonal().array().max(1e-30).sqrt().inverse().matrix();
  Eigen::MatrixXd C = scale.asDiagonal() * S * scale.asDiagonal();
  C.diagonal().array() += 1e-12;
  C = C.ldlt().solve(Eigen::MatrixXd::Identity(kept, kept)).eval();
  C = scale.asDiagonal() * C * scale.asDiagonal();
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(all, all);
  std::vector<Eigen::Index> at;
  Eigen::Index to = 0;
  for (double* block : wanted) {
    const int size = problem.ParameterBlockTangentSize(block);
    for (int k = 0; k < size; ++k, ++to)
      if (takes_part(block)) at.push_back(to);
  }
  for (std::size_t i = 0; i < at.size(); ++i)
    for (std::size_t j = 0; j < at.size(); ++j)
      out(at[i], at[j]) = C(Eigen::Index(i), Eigen::Index(j));
  return out;
}

}  // namespace crane
