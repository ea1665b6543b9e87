#pragma once
/// Where the names of a plot's points go, so that they can be read.

#include <vector>

namespace qjulia::report {

/// Pixels; y runs down.
struct LabelBox {
  double left = 0, top = 0, width = 0, height = 0;
  double right() const { return left + width; }
  double bottom() const { return top + height; }
};

class PlotLabels {
 public:
  explicit PlotLabels(const LabelBox& frame) : frame_(frame) {}

  /// No label is to cover this place.
  void keep_clear(double x, double y) { clear_.push_back({x, y}); }
  /// Nor this line.
  void keep_clear(double x0, double y0, double x1, double y1);

  /// The place of a label of this size for a point: as near to it as leaves every label placed
  /// before and every place kept clear uncovered, within the frame. Where there is none, beside the
  /// point.
  LabelBox place(double x, double y, double width, double height);

 private:
  struct Place {
    double x, y;
  };
  bool is_free(const LabelBox& box) const;

  LabelBox frame_;
  std::vector<Place> clear_;
  std::vector<LabelBox> placed_;
};

}  // namespace qjulia::report
