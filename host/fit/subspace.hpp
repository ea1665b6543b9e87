#pragma once
/// The directions in which a level moves the unknowns: variables coarsened as a multigrid method
/// does it.

#include <Eigen/SparseCore>

#include "fit/schedule.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::fitting {

/// Coarse variables y stand for the move P y of the unknowns (S, exponents, centres' X, Y, Z, W;
/// 1 + 5K of them). P is made at one map: by its exponents' signs and its centres' places.
class Subspace {
 public:
  /// @param allowed `exponents` takes the centres' moves out of every space.
  Subspace(const Map& map, const Level& level, Unknowns allowed);

  /// Whether P is the identity.
  bool is_whole() const { return whole_; }
  Eigen::Index size() const { return prolongation_.cols(); }

  /// P y.
  Eigen::VectorXd prolonged(const Eigen::VectorXd& y) const { return prolongation_ * y; }
  /// Pᵀ g: the gradient by y.
  Eigen::VectorXd restricted_gradient(const Eigen::VectorXd& g) const {
    return prolongation_.transpose() * g;
  }
  /// Pᵀ H P.
  Eigen::MatrixXd restricted_matrix(const Eigen::MatrixXd& h) const {
    return prolongation_.transpose() * (h * prolongation_).eval();
  }
  /// The diagonal of Pᵀ D P, for a diagonal D.
  Eigen::VectorXd restricted_diagonal(const Eigen::VectorXd& d) const {
    return prolongation_.cwiseAbs2().transpose() * d;
  }

 private:
  bool whole_ = false;
  Eigen::SparseMatrix<double> prolongation_;
};

}  // namespace qjulia::fitting
