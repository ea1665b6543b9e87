#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "device/point_batch.hpp"
#include "device/quirks.hpp"
#include "lattice/grid_layout.hpp"
#include "lattice/image_lattice.hpp"
#include "lattice/image_probe.hpp"
#include "lattice/image_table.hpp"
#include "lattice/orbit_lookup.hpp"
#include "layout/march.h"
#include "layout/picture_layout.h"
#include "map/device_map.hpp"
#include "picture/band_grid.hpp"
#include "picture/close_up.hpp"
#include "picture/depth_grid.hpp"
#include "picture/depth_source.hpp"
#include "picture/orbit_traits.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/materials.hpp"
#include "surface/turn_count.hpp"

namespace qjulia::picture {
namespace {

/// What a ray costs, in iterates.
constexpr double kIteratesARay = 30;

/// An upper bound on the iterates of a ray that crosses a usual band by the shortest steps; 130 to
/// 260 were seen for the maps of docs/maps and for fits of few factors.
constexpr double kMostUsualIterates = 300;

/// Maps whose iterate costs less, in factors' logarithms, are not worth interpolating.
constexpr double kWorthInterpolating = 150;
/// A view has a lattice of its own if it shows less than this share of the set.
constexpr double kPart = 0.5;
/// What looking up later iterates may displace in such a view, over what interpolated images may:
/// composed images make up for what the table then serves less. As much as they may where images
/// are not composed.
constexpr double kCloseTableShare = 0.5;
/// Rays in a row that show where such a lattice is to have nodes; nodes that it may have, for
/// memory's sake.
constexpr int kFewColumns = 80;
constexpr double kFewestNodes = 3e5, kMostNodes = 4e6;
/// The depths of these rays tell those of others about to this, pixels.
constexpr double kReach = 2.5;
/// Nodes are spaced for a stretch that this share of the points these rays see stays below.
constexpr double kStretched = 0.9;
/// How far around what is seen rays of lights come from, in steps of the band's grid.
constexpr double kAround = 2;

/// The most that interpolated images may displace what is seen, pixels.
constexpr double kDisplacement = 0.125;
/// What they typically displace, over that.
constexpr double kTypicalShare = 0.2;
/// What looking up later iterates is to displace at the median where memory allows, over that: on
/// thin limbs it is more.
constexpr double kTableShare = 0.3;
/// A lattice of images has at most so many nodes a ray.
constexpr double kNodesARay = 10;
/// A table of images is made once so many rays were asked for.
constexpr double kRaysWorthTable = 5e4;
/// For memory's sake: one for the lights, one for a camera that sees all.
constexpr std::size_t kMostLattices = 2;

/// In a close-up, the places that rays pass through are at least so many pixels wide, and at most
/// so many times as fine as those found for all views.
constexpr double kPixelsAPlace = 1.5, kFinest = 16;
/// The first step of a ray that begins in front of what others hit, pixels; each further one is
/// twice as long, up to the shortest step of other rays, which is longer in close-ups.
constexpr double kFirstStep = 1;
/// Of so many pixels along each side of a block, one ray goes all the way. Compared with
/// steps a quarter as long, such pictures differ no more than if every ray went all the way.
constexpr int kPixelBlock = 3;
/// Pixels along the shorter side of pictures in which all rays go all the way, because limbs may be
/// thinner than a block.
constexpr int kSmallPicture = 100;
/// Points that lie more than so many cells behind the surface in the band's grid are out of sight.
constexpr double kHiddenCells = 4;

/// The greatest width of a speck, in steps of the grid on which loose pieces were sought: in front
/// of something, and with nothing behind.
constexpr double kSpeckSteps = 6, kFreeSpeckSteps = 40;

/// Rays that each lane takes in turn, so that lanes whose rays end early are not idle.
constexpr std::size_t kRaysALane = 16;

/// One ray of a view.
struct Ray {
  double x, y;        ///< pixel coordinates
  float hint = 0;     ///< a depth in front of its hit
  float through = 0;  ///< up to this depth it passes through what lies at the hint
  float until = 0;    ///< all that is asked is whether it hits anything before this depth
};

/// A ray through the middle of a pixel.
struct PixelRay {
  int column, row;
  float hint = 0;
  Ray ray() const { return {column + 0.5, row + 0.5, hint}; }
};

/// The rays of whole rows, in blocks of 4 × 4 pixels, so that lanes do alike.
std::vector<PixelRay> all_rays(int columns, int first_row, int rows) {
  std::vector<PixelRay> rays;
  rays.reserve(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  for (int top = first_row; top < first_row + rows; top += 4) {
    for (int left = 0; left < columns; left += 4) {
      for (int row = top; row < std::min(top + 4, first_row + rows); ++row) {
        for (int column = left; column < std::min(left + 4, columns); ++column) {
          rays.push_back({column, row});
        }
      }
    }
  }
  return rays;
}

/// Whether the view is so narrow that a lattice for what it shows is worth making, of a set of this
/// size.
bool is_close_up(const View& view, const Eigen::Vector3d& size) {
  const double seen = view.footprint * view.footprint * view.columns * view.rows;
  const double whole = size.prod() / size.minCoeff();  // its largest face
  return !view.dir_dx.isZero(0) && seen < kPart * whole;
}

/// A map's box in map coordinates, or where it knows none, one that holds most of its factors.
Box shape_box(const Map& map) {
  return map.frame.box ? map.frame.shape_to_map.to_map(*map.frame.box) : surface::cube(2);
}

class MarchSource : public DepthSource {
 public:
  MarchSource(const Device& device, const MarchedSet& set)
      : set_(set),
        band_(find_band(device, set, shape_box(set.map))),
        grid_(device, set, band_),
        is_counted_(device::launch_watch() != nullptr),
        kernel_(map_.kernel("ray_march.cl", "march_depth", surface::counted_if_watched())) {
    send_loose();
  }

  void stop_with(const std::stop_token& stop) override { set_.stop = stop; }

  std::vector<float> depths(const View& view, int first_row, int rows) override {
    if (grid_.is_empty()) return no_hits(view, rows);
    leave_out_loose(view);
    if (view.coarse_will_do) return grid_.depths(view, first_row, rows);
    if (view.samples == 1) return pixel_rows(view, first_row, rows);
    // One ray a pixel shows where a pixel's samples need rays of their own.
    const View pixels = view.coarse();
    const CoarseRows around = coarse_rows(view.samples, pixels.rows, first_row, rows);
    const DepthGrid found{pixels.columns, around.count,
                          pixel_rows(pixels, around.first, around.count)};
    return refine(view, first_row, rows, {found, around.first, view.samples}, Smooth::interpolated);
  }

  void prepare(const View& view) override {
    if (grid_.is_empty()) return;
    rays_ += static_cast<double>(view.columns) * view.rows;
    // The finest view first: its tables serve the others.
    const bool is_close = is_close_up(view, grid_.bounds().size());
    table_for((is_close ? kCloseTableShare : 1) * displacement_of(view));
    leave_out_loose(view);
    look_finer(view);
    // Wide lattices are made for the lights first, which are the same for all cameras.
    if (is_close) lattice_for(view);
  }

  std::vector<float> traits(const std::vector<Eigen::Vector3d>& points,
                            std::span<const double> widths) override {
    if (!facts_of(set_.material).is_of_orbits) return {};
    return orbit_traits(map_, points, widths, set_.iterations, set_.material, set_.stop);
  }

  std::vector<Eigen::Vector3d> outline() override {
    const auto is_same = [](const Box& a, const Box& b) {
      return a.low == b.low && a.high == b.high;
    };
    if (!set_.part || (set_.framed && is_same(*set_.part, *set_.framed))) return grid_.outline();
    MarchedSet whole = set_;
    whole.part = set_.framed;
    return BandGrid(map_.device(), whole, band_).outline();
  }

  std::vector<float> ways_inside(const std::vector<Eigen::Vector3d>& points) override {
    return grid_.ways_inside(points);
  }

  Box bounds() const override { return grid_.bounds(); }

  LoosePieces loose_pieces() const override { return loose_.pieces; }

  double largest_speck() const override { return largest_of(kSpeckSteps); }
  double largest_free_speck() const override { return largest_of(kFreeSpeckSteps); }

  std::vector<float> depths_beyond(const View& view,
                                   const std::vector<PassingRay>& passing) override {
    std::vector<float> depths(passing.size());
    std::vector<Ray> rays;
    std::vector<std::size_t> numbers;
    for (std::size_t i = 0; i < passing.size(); ++i) {
      const PassingRay& ray = passing[i];
      if (may_be_cut_off(view, ray)) {
        depths[i] = ray.until;
        continue;
      }
      // The hit lies between this and the tolerance before it.
      const auto hint = ray.hit + static_cast<float>(view.tolerance);
      rays.push_back({ray.column + 0.5, ray.row + 0.5, hint, ray.until});
      numbers.push_back(i);
    }
    march(view, served(view), rays,
          [&](std::size_t i, float depth) { depths[numbers[i]] = depth; });
    return depths;
  }

  std::vector<bool> blocked(const View& light, const View& seen_by,
                            const std::vector<LightRay>& asked) override {
    if (asked.empty()) return {};  // of an empty set there is nothing to look up
    View view = light;
    view.tolerance = seen_by.tolerance;
    std::vector<Ray> rays;
    rays.reserve(asked.size());
    const auto near = static_cast<float>(seen_by.footprint * seen_by.samples);
    for (const LightRay& ray : asked) {
      rays.push_back({ray.x, ray.y, std::max(0.0F, ray.from), 0, ray.to - near});
    }
    std::vector<bool> found(rays.size());
    march(view, served(seen_by), rays,
          [&](std::size_t i, float depth) { found[i] = depth >= 0 && depth < rays[i].until; });
    return found;
  }

  LookupReport lookups() const override {
    LookupReport report;
    if (close_up_ || !lattices_.empty()) {
      const surface::ImageLattice& made = close_up_ ? close_up_->lattice : lattices_.back();
      report.nodes = made.nodes();
      report.trusted_share = made.trusted_share();
      report.iterates = std::max(made.iterates(), 1);
    }
    if (table_ && !table_->is_empty()) {
      report.table_bytes =
          table_->bricks().bytes() + table_->fields().bytes() + table_->versors().bytes();
    }
    return report;
  }

 private:
  /// So many steps of the grid on which loose pieces were sought, or a body's width where that is
  /// less.
  double largest_of(double steps) const {
    return std::min(steps * loose_.resolution, std::cbrt(loose_.largest_loose));
  }

  /// Whether what the ray has hit may be attached to what is cut away.
  bool may_be_cut_off(const View& view, const PassingRay& ray) const {
    if (!set_.part) return false;
    const Eigen::Vector3d at = view.at(ray.column + 0.5, ray.row + 0.5, double{ray.hit});
    const double away =
        std::min((at - set_.part->low).minCoeff(), (set_.part->high - at).minCoeff());
    return away < double{ray.until} - double{ray.hit};
  }

  /// Tables for rays.
  struct Served {
    const surface::ImageLattice& lattice;
    int tabled;
    double footprint;  ///< of a ray: what is finer than this is not seen
  };
  /// What serves the view's rays.
  Served served(const View& view) {
    const surface::ImageLattice& lattice = lattice_for(view);
    const bool is_own = close_up_ && &lattice == &close_up_->lattice;
    return {lattice, is_own ? close_up_->tabled : tabled_for(displacement_of(view)),
            view.footprint};
  }

  /// Finds the loose pieces at the first view, by what serves its rays.
  void leave_out_loose(const View& view) {
    // Copies in portals may be smaller than what the grid shows of where they stand.
    if (has_sought_loose_ || set_.keeps_loose || !set_.map.layers.portals.empty()) return;
    if (set_.part) {
      // What is cut away may be what a piece hangs on.
      MarchedSet whole = set_;
      whole.part.reset();
      whole_ = std::make_unique<BandGrid>(map_.device(), whole, band_);
    }
    whole_grid().look_up(lookup(view, kDisplacement * whole_grid().step()));
    loose_ = whole_grid().loose_places();
    grid_.leave_out(loose_);
    if (loose_.bits.empty()) whole_.reset();
    send_loose();
    has_sought_loose_ = true;
  }
  /// Null where orbits cannot be looked up for this displacement.
  std::shared_ptr<const surface::OrbitLookup> lookup(const View& view, double displacement) {
    const surface::ImageTable& table = table_for(displacement);
    const int tabled = table.first_iterate(displacement);
    if (tabled > 2) return nullptr;
    const bool is_close = is_close_up(view, grid_.bounds().size());
    const surface::ImageLattice& lattice =
        is_close ? wide_lattice(kDisplacement * whole_grid().step()) : lattice_for(view);
    return std::make_shared<const surface::OrbitLookup>(
        surface::OrbitLookup{lattice, table, tabled});
  }
  /// The grid over the whole set.
  BandGrid& whole_grid() { return whole_ ? *whole_ : grid_; }

  /// Looks again at the loose pieces in sight, at about the resolution of the pixels.
  void look_finer(const View& view) {
    if (loose_.bits.empty()) return;
    const double samples = loose_.grid.step / view.footprint;
    const double finer = std::clamp(samples / (view.samples * kPixelsAPlace), 1.0, kFinest);
    View places = view;
    places.samples = std::clamp(static_cast<int>(samples), 1, std::min(view.columns, view.rows));
    places = places.coarse();
    const InSight in_sight(places, grid_.depths(places, 0, places.rows),
                           kHiddenCells * grid_.step());
    whole_grid().look_up(lookup(view, kDisplacement * whole_grid().step() / finer));
    whole_grid().look_finer(loose_, static_cast<int>(std::bit_floor(static_cast<unsigned>(finer))),
                            in_sight, set_.stop);
    send_finer();
  }
  void send_loose() {
    loose_layout_ = map_.context().upload_real(surface::grid_layout(loose_.grid), set_.precision);
    loose_bits_ = uploaded(loose_.bits);
    send_finer();
  }
  void send_finer() {
    finer_cells_ = uploaded(loose_.finer_cells);
    finer_bits_ = uploaded(loose_.finer_bits);
  }

  /// A kernel's buffer must not be empty.
  device::Buffer<std::uint32_t> uploaded(const std::vector<std::uint32_t>& words) const {
    return map_.context().upload<std::uint32_t>(words.empty() ? std::vector{0U} : words);
  }

  /// How far interpolated images may displace what is seen of the view, map units.
  static double displacement_of(const View& view) {
    return kDisplacement * view.footprint * view.samples;
  }
  /// Whether images are worth interpolating.
  bool interpolates() const {
    return set_.interpolates_images && map_.interpolates() &&
           map_.step_cost() >= kWorthInterpolating && set_.iterations > 1;
  }

  /// Serves the second iterate for this displacement if memory allows. Empty until so many rays
  /// were asked for that it pays.
  const surface::ImageTable& table_for(double displacement) {
    if (!table_) table_.emplace(map_);
    const bool is_worth_making =
        std::max(rays_, set_.rays) >= kRaysWorthTable && interpolates() && set_.iterations > 2;
    if (is_worth_making && displacement < table_made_for_ &&
        table_->first_iterate(displacement) > 2) {
      table_ = surface::ImageTable::of_ball(map_, kTableShare * displacement, set_.stop);
      table_made_for_ = table_->is_empty() || table_->is_finest() ? 0 : displacement;
    }
    return *table_;
  }

  /// The numbers of the cells that rays run orbits in, of those that have a cell on every side.
  std::vector<std::int32_t> cells_asked_for(const surface::Grid& grid) const {
    constexpr int kBlock = 4;        // cells along the sides of blocks that are asked about first
    constexpr double kMargin = 1.3;  // steps grow by more than the way in steep places
    const double reach = std::sqrt(0.75) * grid.step;  // from a cell's middle to its corners
    const auto is_near = [&](const Eigen::Vector3d& middle, double cells_away) {
      return grid_.has_orbits_near(grid.at(middle), cells_away * reach);
    };
    const Eigen::Vector3i last = grid.points.array() - 3;
    std::vector<std::int32_t> cells;
    surface::for_points((last.array() + kBlock - 1) / kBlock, [&](std::size_t,
                                                                  const Eigen::Vector3i& block) {
      const Eigen::Vector3i first = kBlock * block.array() + 1;
      if (!is_near(first.cast<double>().array() + 0.5 * kBlock, kMargin * kBlock)) return;
      surface::for_points((last - first).cwiseMin(kBlock - 1).array() + 1,
                          [&](std::size_t, const Eigen::Vector3i& inner) {
                            const Eigen::Vector3i cell = first + inner;
                            if (!is_near(cell.cast<double>().array() + 0.5, 1)) return;
                            cells.push_back(device::narrow(surface::number_of(cell, grid.points)));
                          });
    });
    return cells;
  }

  /// The first iterate that may be looked up in the table for this displacement.
  int tabled_for(double displacement) {
    return std::min(table_for(displacement).first_iterate(displacement), set_.iterations + 1);
  }

  /// How far first iterates move where points do.
  double stretch() {
    // In a factor map the versor turns faster than F rises.
    if (!stretch_) stretch_ = std::max(band_.steepest, surface::first_stretch(map_, set_.stop));
    return *stretch_;
  }

  /// What serves rays all over the set, for this displacement.
  const surface::ImageLattice& wide_lattice(double displacement) {
    const Box& box = grid_.bounds();
    if (!interpolates()) {
      if (lattices_.empty()) lattices_.emplace_back(map_);
      return lattices_.front();
    }
    const auto found = std::ranges::find_if(lattices_, [&](const surface::ImageLattice& made) {
      return made.serves(box, displacement);
    });
    if (found != lattices_.end()) return *found;
    if (lattices_.size() == kMostLattices) lattices_.pop_front();
    return lattices_.emplace_back(
        map_, box, [&](const surface::Grid& grid) { return cells_asked_for(grid); },
        surface::ImageLattice::Fineness{displacement, kTypicalShare * displacement, stretch(),
                                        kNodesARay * rays_},
        set_.stop);
  }

  /// What serves the view's rays; made at the first call.
  const surface::ImageLattice& lattice_for(const View& view) {
    const double displacement = displacement_of(view);
    if (!interpolates() || !is_close_up(view, grid_.bounds().size())) {
      return wide_lattice(displacement);
    }
    // Views through a lens follow the one from its middle, and look in about its direction.
    const bool serves = close_up_ && close_up_->eye == view.lens_eye.value_or(view.eye) &&
                        (view.lens_eye || close_up_->dir == view.dir) &&
                        close_up_->displacement == displacement;
    if (!serves) {
      close_up_.reset();
      const int tabled = tabled_close_up(view, displacement);
      close_up_.emplace(MadeCloseUp{view.eye, view.dir, displacement, tabled,
                                    lattice_of(view, displacement, tabled)});
    }
    return close_up_->lattice;
  }

  /// How far images after so many iterates move where points do.
  double stretch_after(int iterates) {
    return stretch() * std::pow(table_->stretch(), iterates - 1);
  }

  /// The first iterate that is looked up in the table in a close-up.
  int tabled_close_up(const View& view, double displacement) {
    const int tabled = tabled_for(kCloseTableShare * displacement);
    const bool is_worth = tabled > 2 && is_worth_composing(view, kTypicalShare * displacement,
                                                           stretch_after(tabled - 1));
    return is_worth ? tabled : tabled_for(displacement);
  }

  /// @param tabled the first iterate that is looked up in the table.
  surface::ImageLattice lattice_of(const View& view, double displacement, int tabled) {
    View few = view;
    few.samples = std::clamp(view.columns / kFewColumns, 1, std::min(view.columns, view.rows));
    few = few.coarse();
    CloseUp close_up{
        .view = view,
        .few = few,
        .depths = no_hits(few, few.rows),
        .displacement = displacement,
        .typical = kTypicalShare * displacement,
        .stretches = {},
        .around = kAround * grid_.step(),
        .outer = map_.log_outer(),
        .steepest = band_.steepest,
        .most_nodes = std::clamp(kNodesARay * view.columns * view.rows, kFewestNodes, kMostNodes)};
    // Paint bends F of the iterates in between. Where there is no table, F and U of all later
    // iterates have to be computed, beside which those of one more matter little.
    const int most =
        table_->is_empty() || set_.map.layers.paint ? 1 : std::min(tabled, set_.iterations) - 1;
    close_up.reach = kReach * view.footprint * view.samples;
    const surface::ImageLattice none(map_);
    const std::vector<PixelRay> pixels = all_rays(few.columns, 0, few.rows);
    std::vector<Ray> rays(pixels.size());
    std::ranges::transform(pixels, rays.begin(), &PixelRay::ray);
    march(few, {none, tabled, view.footprint}, rays, [&](std::size_t i, float depth) {
      close_up.depths[index(pixels[i].column, pixels[i].row, few.columns)] = depth;
    });
    std::vector<Eigen::Vector3d> seen;
    for (std::size_t i = 0; i < close_up.depths.size(); ++i) {
      const double depth = double{close_up.depths[i]};
      const auto wide = static_cast<std::size_t>(few.columns);
      const std::size_t column = i % wide, row = i / wide;
      if (depth >= 0) {
        seen.push_back(
            few.at(static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5, depth));
      }
    }
    close_up.stretches =
        surface::stretches_at(map_, seen, std::max(most, 1), kStretched, set_.stop);
    // Where less is seen to stretch, images are not smoother for it.
    for (int n = 1; n <= std::max(most, 1); ++n) {
      if (static_cast<int>(close_up.stretches.size()) < n) close_up.stretches.push_back(1);
      double& seen_to = close_up.stretches[static_cast<std::size_t>(n - 1)];
      seen_to = std::max(seen_to, stretch_after(n));
    }
    const auto has_orbits_near = [&](const Eigen::Vector3d& p, double reach) {
      return grid_.has_orbits_near(p, reach);
    };
    const auto fields_after = [&](std::span<const surface::ImageLattice::Level> levels) {
      const auto of_levels = std::make_shared<surface::ImageLattice>(map_, levels, set_.stop);
      return [this, of_levels](const std::vector<Eigen::Vector3d>& points) {
        return surface::looked_up_fields(map_, *of_levels, *table_, of_levels->iterates() + 1,
                                         points, set_.stop);
      };
    };
    return {map_, levels_for(close_up, has_orbits_near, fields_after), set_.stop};
  }

  static std::vector<float> no_hits(const View& view, int rows) {
    return std::vector<float>(index(0, rows, view.columns), static_cast<float>(QJ_NO_HIT));
  }

  /// The least difference between depths that rounding leaves, with a margin: rays that took
  /// shorter steps, or were bisected further, would never end.
  double finest_step(const View& view) const {
    const double farthest = view.eye.norm() + band_.radius;
    return farthest * (set_.precision == Precision::dbl ? 0x1p-50 : 0x1p-21);
  }
  /// The least step of rays: fine enough for what they show, and for the shell's own grain.
  double shortest_step(const View& view, double footprint) const {
    const double shell = 1 / band_.steepest;
    // Coarser steps lose sheets and spikes that close-ups show (docs/lab/performance.md). Copies in
    // portals have finer grain than any shell: there pixels alone decide.
    const double grain = map_.has_portals() ? 0 : shell / 80;
    return std::max(finest_step(view), std::clamp(footprint, grain, shell / 6));
  }

  /// @param take takes (i, depth), the depth of ray i. @param first the least first step after a
  /// hint; shortest_step if that is less.
  template <class Take>
  void march(const View& view, const Served& with, const std::vector<Ray>& rays, const Take& take,
             double first = std::numeric_limits<double>::infinity()) {
    device::Context& context = map_.context();
    const auto packed = context.upload_real(view.packed(), set_.precision);
    const double finest = finest_step(view), step = shortest_step(view, with.footprint);
    const double tolerance = std::max(finest, view.tolerance);
    if (grid_.step() < 4 * finest) {
      throw Error(fmt::format(
          "the set is too small for its distance of {:.2g} from the eye or the map's origin to be "
          "drawn in {} precision",
          view.eye.norm() + band_.radius, to_string(set_.precision)));
    }
    const surface::ImageLattice& lattice = with.lattice;
    // The table's F is that of the map's kind, without paint.
    const bool ends_by_table = !table_->is_empty() && !set_.map.layers.paint;
    // Where undecided points reach far, a launch takes fewer rays, so that none takes long.
    const double longer =
        std::max(1.0, set_.iterations * grid_.way_in_band() / step / kMostUsualIterates);
    const std::size_t rays_a_lane = device::share_of_lane(map_.device().info(), kRaysALane);
    const std::size_t share =
        map_.lanes() * std::max<std::size_t>(
                           1, static_cast<std::size_t>(static_cast<double>(rays_a_lane) / longer));
    device::PointBatch batch(context, kernel_, set_.precision, share,
                             map_.step_cost() * kIteratesARay * longer);
    const surface::TurnCount turns(map_, is_counted_, (rays.size() + share - 1) / share);
    batch.run<5, 1>(
        rays.size(),
        [&](std::size_t i) {
          const Ray& ray = rays[i];
          return std::array{ray.x, ray.y, double{ray.hint}, double{ray.through}, double{ray.until}};
        },
        [&](const device::PointBatch::Part& part) {
          const auto march = device::arguments(set_.precision, [&](auto r) {
            using real = decltype(r);
            return qj_march<real>{.radius = real(band_.radius),
                                  .steepest = real(band_.steepest),
                                  .shortest = real(step),
                                  .first = real(std::min(step, first)),
                                  .tolerance = real(tolerance),
                                  .margin = real(table_->margin()),
                                  .iterations = set_.iterations,
                                  .stride = device::narrow(part.stride),
                                  .count = device::narrow(part.count),
                                  .share = device::narrow(share),
                                  .sided = ends_by_table ? std::min(2, with.tabled) : with.tabled,
                                  .tabled = with.tabled,
                                  .finer = loose_.finer};
          });
          surface::Arguments arguments({map_.buffer(),
                                        map_.factors(),
                                        march,
                                        packed,
                                        part.in,
                                        grid_.layout(),
                                        grid_.safe(),
                                        lattice.layout(),
                                        lattice.places(),
                                        lattice.field(),
                                        lattice.versors(),
                                        lattice.trusted(),
                                        table_->layout(),
                                        table_->bricks(),
                                        table_->fields(),
                                        table_->versors(),
                                        loose_layout_,
                                        loose_bits_,
                                        finer_cells_,
                                        finer_bits_,
                                        part.out});
          turns.append_to(arguments);
          return device::PartCall{std::move(arguments),
                                  device::moving(5 * static_cast<double>(part.count))};
        },
        [&](std::size_t i, const std::array<double, 1>& depth) {
          take(i, static_cast<float>(depth[0]));
        },
        map_.lanes() == 1 ? 64 : 1, set_.stop);
    turns.tell("march_depth");
  }

  /// Puts the depths of these rays in their places among those of rows from `first_row` on.
  void march_into(const View& view, const Served& with, const std::vector<PixelRay>& pixels,
                  int first_row, std::vector<float>& depths) {
    std::vector<Ray> rays(pixels.size());
    std::ranges::transform(pixels, rays.begin(), &PixelRay::ray);
    march(
        view, with, rays,
        [&](std::size_t i, float depth) {
          depths[index(pixels[i].column, pixels[i].row - first_row, view.columns)] = depth;
        },
        kFirstStep * view.footprint * view.samples);
  }

  /// Every ray of these rows, all the way.
  std::vector<float> march_rows(const View& view, const Served& with, int first_row, int rows) {
    std::vector<float> depths = no_hits(view, rows);
    march_into(view, with, all_rays(view.columns, first_row, rows), first_row, depths);
    return depths;
  }

  /// One ray in each block of pixels goes all the way, and shows where the others begin.
  std::vector<float> pixel_rows(const View& view, int first_row, int rows) {
    const Served with = served(view);
    if (std::min(view.columns, view.rows) < kSmallPicture) {
      return march_rows(view, with, first_row, rows);
    }
    View blocks = view;
    blocks.samples = kPixelBlock;
    blocks = blocks.coarse();
    const CoarseRows around = coarse_rows(kPixelBlock, blocks.rows, first_row, rows);
    const DepthGrid found{blocks.columns, around.count,
                          march_rows(blocks, with, around.first, around.count)};
    return refine(view, first_row, rows, {found, around.first, kPixelBlock}, Smooth::marched);
  }

  /// Rows of a coarser view that show what rays of some rows hit.
  struct CoarseRows {
    int first, count;
  };
  /// @param wide rays of the finer view along a side of a coarse pixel. @param all coarse rows.
  static CoarseRows coarse_rows(int wide, int all, int first_row, int rows) {
    // As far around as `DepthGrid::nearest` looks.
    const int first = std::clamp(first_row / wide - 2, 0, all - 1);
    return {first, std::min(all, (first_row + rows - 1) / wide + 3) - first};
  }

  /// What a coarser view of the same shows.
  struct Coarse {
    const DepthGrid& depths;
    int first_row;
    int wide;  ///< rays of the finer view along a side of one of its pixels
  };
  enum class Smooth { interpolated, marched };

  /// Depths of a view's rays, which begin just in front of what a coarser view shows about them.
  /// @param smooth what becomes of rays where that is smooth.
  std::vector<float> refine(const View& view, int first_row, int rows, const Coarse& coarse,
                            Smooth smooth) {
    const DepthGrid& found = coarse.depths;
    const double width = view.footprint * coarse.wide;
    std::vector<float> depths = no_hits(view, rows);
    std::vector<PixelRay> rays;
    for (PixelRay ray : all_rays(view.columns, first_row, rows)) {
      const int i = std::min(ray.column / coarse.wide, found.columns - 1);
      const int j = std::min(ray.row / coarse.wide - coarse.first_row, found.rows - 1);
      // A view may have a few rays more than whole coarse pixels.
      const double x = std::min((ray.column + 0.5) / coarse.wide - 0.5, found.columns - 1.0);
      const double y =
          std::min((ray.row + 0.5) / coarse.wide - 0.5 - coarse.first_row, found.rows - 1.0);
      const PixelKind kind = found.kind(i, j, width);
      if (kind == PixelKind::empty) continue;
      if (kind == PixelKind::smooth && smooth == Smooth::interpolated) {
        depths[index(ray.column, ray.row - first_row, view.columns)] = found.interpolated(x, y);
        continue;
      }
      ray.hint = std::max(0.0F, found.nearest(x, y) - static_cast<float>(width));
      rays.push_back(ray);
    }
    march_into(view, served(view), rays, first_row, depths);
    return depths;
  }

  MarchedSet set_;
  Band band_;
  BandGrid grid_;
  const map::DeviceMap& map_ = grid_.map();
  bool is_counted_;  ///< whether the kernel counts its turns
  device::Kernel kernel_;
  surface::LoosePlaces loose_;
  bool has_sought_loose_ = false;
  device::RealBuffer loose_layout_;
  device::Buffer<std::uint32_t> loose_bits_, finer_cells_, finer_bits_;
  std::unique_ptr<BandGrid> whole_;             ///< where `grid_` is over a part
  std::deque<surface::ImageLattice> lattices_;  ///< over all of the set
  struct MadeCloseUp {
    Eigen::Vector3d eye, dir;
    double displacement;
    int tabled;  ///< the first iterate that is looked up in the table
    surface::ImageLattice lattice;
  };
  std::optional<MadeCloseUp> close_up_;
  std::optional<surface::ImageTable> table_;
  /// The least displacement that a table was made for; 0 when no finer one can be made.
  double table_made_for_ = std::numeric_limits<double>::infinity();
  std::optional<double> stretch_;  ///< of first iterates
  double rays_ = 1;                ///< of all views that were prepared
};

}  // namespace

std::unique_ptr<DepthSource> march_source(const Device& device, const MarchedSet& set) {
  return std::make_unique<MarchSource>(device, set);
}

}  // namespace qjulia::picture
