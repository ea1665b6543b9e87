#pragma once
/// The extremes of F_1 over 4-D spheres about the origin, by local search from many directions.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/random.hpp"
#include "qjulia/field.hpp"

namespace qjulia::map {

enum class Extreme { lowest, highest };

class SphereSearch {
 public:
  SphereSearch(const Field& field, Extreme wanted) : field_(field), wanted_(wanted) {}

  /// Begins anew from the best of `directions` (unit), judged by `values` = F_1 there.
  void seed(const std::vector<Quaternion>& directions, const std::vector<double>& values);

  /// The most extreme F_1 found on the sphere of `radius`; the seeds move to where it is.
  double refine(double radius);

 private:
  bool better(double a, double b) const { return wanted_ == Extreme::lowest ? a < b : a > b; }
  Quaternion perturbed(const Quaternion& direction, double size);
  std::vector<double> values_at(const std::vector<Quaternion>& directions, double radius) const;

  const Field& field_;
  Extreme wanted_;
  std::vector<Quaternion> seeds_;
  base::Random random_{1};
};

}  // namespace qjulia::map
