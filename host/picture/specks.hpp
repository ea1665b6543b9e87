#pragma once
/// Depths of a picture without artefacts that catch the eye: specks that hang on nothing and that
/// the grids on which loose pieces are found have missed, and pits as narrow as a pixel.

#include <cstddef>
#include <vector>

#include "picture/depth_grid.hpp"
#include "picture/depth_source.hpp"
#include "picture/view.hpp"

namespace qjulia::picture {

/// Samples that hang together: depths of neighbours, of which a sample has eight, differ by no more
/// than a gap.
using SampleGroup = std::vector<std::size_t>;

/// The groups that are at most `most` samples wide and high and whose surroundings all lie behind
/// them; a sample that shows nothing is behind everything. None reaches the edges of the grid.
/// @param tips marks samples that hang together with whatever is seen beside them, since they are
/// attached to something behind; empty for none.
std::vector<SampleGroup> islands(const DepthGrid& grid, double gap, int most,
                                 const std::vector<bool>& tips = {});

/// The same for groups whose surroundings all lie in front of them. Samples that show nothing may
/// form such a group.
std::vector<SampleGroup> pits(const DepthGrid& grid, double gap, int most);

/// Depths of a view, row by row from the top, a slab of many rows at a time. The rays of an island
/// go on behind it if they come out of it: then it is a speck, else it is the tip of something.
/// What they meet may be another island; up to eight in a row are removed. Pits are filled to the
/// level of their rims. No depth depends on how the rows are divided.
class SpecklessDepths {
 public:
  static constexpr std::size_t kSlab = std::size_t{1} << 24;  ///< samples

  /// @param slab samples that are computed at a time, in whole rows.
  SpecklessDepths(DepthSource& source, const View& view, std::size_t slab = kSlab);

  std::vector<float> rows(int first, int count);

 private:
  /// How far to each side of a sample its depth depends on others.
  int reach() const;
  void compute(int first, int count);
  /// The source's depths from row `first` to before row `last`.
  std::vector<float> source_rows(int first, int last) const;
  void leave_out_islands(DepthGrid& grid, int first_row) const;

  DepthSource& source_;
  View view_;
  int rows_at_once_;
  double pixel_;     ///< its width, depths
  int widest_;       ///< specks, in samples
  int widest_free_;  ///< specks with nothing behind them
  int from_ = 0;     ///< the first row of `known_`
  std::vector<float> known_;
  int source_from_ = 0;              ///< the first row of `source_known_`
  std::vector<float> source_known_;  ///< what the source gave last: slabs look beyond their rows
};

/// All depths of a view.
std::vector<float> speckless_depths(DepthSource& source, const View& view);

}  // namespace qjulia::picture
