#pragma once
/// The way of a camera that pans and zooms at once, along which the picture always moves equally
/// fast: van Wijk and Nuij, “Smooth and efficient zooming and panning” (InfoVis 2003).

namespace qjulia::film {

/// What is seen on the way: how far the camera has panned, and the width of what it sees.
struct Sight {
  double panned = 0;
  double width = 1;
};

class Geodesic {
 public:
  /// How much zooming is preferred to panning: what the paper's readers found best.
  static constexpr double kRho = 1.4142135623730951;

  /// @param distance between the middles of what is seen first and last, 0 or more. @param from the
  /// width that is seen first. @param to that is seen last. Both above 0, in the unit of
  /// `distance`.
  Geodesic(double distance, double from, double to);

  /// Its length by the paper's metric, ds² = (du² ρ² + dw² / ρ²) / w²: how long it looks.
  double length() const { return length_; }
  /// @param way 0 at the beginning, 1 at the end.
  Sight at(double way) const;

 private:
  double distance_, from_, to_;
  double begin_ = 0;  ///< r₀ of the paper
  double length_ = 0;
  bool is_straight_ = false;  ///< it only zooms
};

}  // namespace qjulia::film
