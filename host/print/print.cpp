#include "qjulia/surface/print.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "print/cavity.hpp"
#include "print/slab_distances.hpp"
#include "print/thick_walls.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/decimate.hpp"
#include "qjulia/surface/print_settings.hpp"
#include "surface/marching_cubes.hpp"

namespace qjulia {

using namespace surface;
namespace {

/// The least number of grid steps per wall: with fewer, balls look like cubes; more take longer.
constexpr double kStepsAWall = 4, kMostStepsAWall = 16;
/// The same where decimation leaves so few triangles that their edges are longer than this share of
/// the least wall: of the balls' shape nothing is seen then. A try takes less than half of the
/// time.
constexpr double kStepsAWallOfFew = 3, kLongEdge = 0.5;
/// Cells along the longest side, where the mesh's edges are longer than these.
constexpr double kFewestCells = 128;
constexpr double kStepsADrain = 6, kStepsACavityWall = 4;
/// A drain is at most this share of the mesh's width.
constexpr double kWidestDrain = 0.5;
/// A share of the least wall: parts that stand out by less are removed, not thickened.
constexpr double kShavedShare = 0.2;
/// The radius of the first try, as a multiple of the least wall; walls that come out thinner are
/// thickened again.
constexpr double kFirstRadius = 0.52;
constexpr double kLeastGrowth = 1.02, kMostGrowth = 1.1;
/// The most that it grows by where few triangles are left.
constexpr double kMostGrowthForFew = 1.6;
/// The thickest walls that are made for the sake of decimation, over the least wall: when a first
/// decimation has shown what gets lost, and when a second one has shown how that grows.
constexpr double kThickestAtFirst = 1.8, kThickestLater = 2.5;
constexpr int kMostPrintSteps = 6;
/// Triangles are read back in single precision, and walls are measured on them.
constexpr double kWallSlack = 1.003;
/// Coarser triangles make walls thinner; walls are made thicker by this factor beforehand.
constexpr double kDecimationSlack = 1.02;
/// A shell is at least this multiple of the least wall, because a cavity's surface is off by up to
/// a tenth of its grid's step, of which there are four in a shell.
constexpr double kShellSlack = 1.03;
/// If the size after the first try is off by more than this share, the foot is cut again at another
/// scale.
constexpr double kFootSlack = 0.02;
/// An arbitrary part of a step, so that no line of the grid coincides with lines of the mesh.
constexpr double kPrintMargin = 3.3713, kHollowMargin = 3.4231;
constexpr std::size_t kSlabPoints = std::size_t{1} << 25;
constexpr std::size_t kMostSlabPoints = std::size_t{1} << 27;
constexpr int kFewestSlices = 8;

double mean_edge_of(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto& x = mesh.vertices;
    sum += (x[b] - x[a]).norm() + (x[c] - x[b]).norm() + (x[a] - x[c]).norm();
  }
  return sum / (3 * static_cast<double>(mesh.triangles.size()));
}

void turn_mesh(TriangleMesh& mesh, const Eigen::Matrix3d& rotation) {
  for (Eigen::Vector3d& x : mesh.vertices) x = rotation * x;
  for (Eigen::Vector3f& n : mesh.normals) n = rotation.cast<float>() * n;
}

void enlarge(TriangleMesh& mesh, double factor) {
  for (Eigen::Vector3d& x : mesh.vertices) x *= factor;
}

/// The field of the mesh to make, given the distances of the one that there is at some slices. The
/// first of these is slice `first` of the grid.
using FieldFromNear = std::function<SlabField(SlabField near, int first)>;

/// Where the foot is cut, and the grid's planes on either side of it.
class Foot {
 public:
  explicit Foot(std::optional<double> height) : height_(height) {}

  /// Moves the grid so that the foot is half-way between two of its points.
  void align(Grid& grid) const {
    if (!height_) return;
    const double steps = (*height_ - grid.origin.z()) / grid.step;
    grid.origin.z() += (steps - std::floor(steps) - 0.5) * grid.step;
    grid.points.z() += 1;
  }

  /// The foot's height in steps above a slice of the grid, if there is a foot.
  std::optional<float> above(const Grid& grid, int slice) const {
    if (!height_) return std::nullopt;
    return static_cast<float>((*height_ - grid.origin.z()) / grid.step - slice);
  }

  /// Leaves what is above the foot.
  void cut(const Grid& grid, int first, SlabField& field) const {
    if (!height_) return;
    const std::size_t slice = slices(grid, 0, 1).size();
    for (std::size_t i = 0; i < field.values.size(); ++i) {
      const double z = grid.origin.z() + grid.step * (first + static_cast<int>(i / slice));
      const auto below = static_cast<float>((*height_ - z) / grid.step);
      const float value = std::max(field.values[i], below);
      const bool is_known = value == field.values[i] || std::abs(value) <= kNearReach;
      field.values[i] = is_known ? value : std::copysign(kFarAway, value);
    }
  }

  /// Interpolation has put the vertices of the foot on the plane but for rounding.
  void flatten(TriangleMesh& mesh, double step) const {
    if (!height_) return;
    for (Eigen::Vector3d& x : mesh.vertices) {
      if (std::abs(x.z() - *height_) < 0.25 * step) x.z() = *height_;
    }
  }

 private:
  std::optional<double> height_;
};

/// Meshes a field slab by slab.
TriangleMesh meshed(const TriangleMesh& mesh, const Grid& grid, int halo, const char* activity,
                    const FieldFromNear& field_of, const ProgressMonitor& monitor) {
  const MeshInGrid placed(mesh, grid);
  const std::size_t slice = slices(grid, 0, 1).size();
  const int at_once = std::max(kFewestSlices, static_cast<int>(kSlabPoints / slice) - 2 * halo);
  MeshSink sink;
  MarchingCubes cubes(grid.points, 0);
  MeshBuilder builder(grid, {}, sink);
  const Slab slab = unclassified_slab(grid, grid.points.z());
  for (int z = 0; z < grid.points.z(); z += at_once) {
    throw_if_stopped(monitor.stop);
    monitor.report({activity, static_cast<double>(z) / grid.points.z(), -1, {}});
    const int count = std::min(at_once, grid.points.z() - z);
    const int first = std::max(0, z - halo), last = std::min(grid.points.z(), z + count + halo);
    const SlabField field = field_of(placed.distances(first, last - first, monitor.stop), first);
    const std::span<const float> values = field.values;
    for (int k = z - first; k < z - first + count; ++k) {
      cubes.add(values.subspan(static_cast<std::size_t>(k) * slice, slice), slab);
    }
    builder.add(cubes.take());
  }
  return std::move(sink.mesh);
}

/// @throws OptionError naming `option` when the grid is too fine.
Grid checked_grid(const TriangleMesh& mesh, double step, double margin, int halo, const Foot& foot,
                  const char* option) {
  const Box box = mesh.box();
  const double across = (box.size().array() / step).maxCoeff() + 2 * margin;
  const double points = across * across * (kFewestSlices + 2.0 * halo);
  if (!(points <= static_cast<double>(kMostSlabPoints))) {
    throw OptionError(option, fmt::format("a mesh {:.4g} long would need {:.0f} cells; give a "
                                          "larger number, or make the mesh smaller",
                                          box.size().maxCoeff(), across));
  }
  Grid grid = grid_around(box, step, margin);
  foot.align(grid);
  return grid;
}

/// The mesh cut at its foot, and with walls of at least twice the radius; 0 for walls as they are.
TriangleMesh solid_of(const TriangleMesh& mesh, double radius, double min_wall, double step,
                      const Foot& foot, const ProgressMonitor& monitor) {
  const bool thickens = radius > 0;
  const ThickWalls walls{static_cast<float>(radius / step),
                         static_cast<float>(kShavedShare * min_wall / step)};
  const int halo = thickens ? halo_of(walls) : 0;
  const Grid grid = checked_grid(mesh, step, kPrintMargin + (thickens ? margin_of(walls) : 0), halo,
                                 foot, thickens ? "min_wall" : "flat_foot");
  TriangleMesh result = meshed(
      mesh, grid, halo, thickens ? "thickening walls" : "cutting the foot",
      [&](SlabField near, int first) {
        foot.cut(grid, first, near);
        if (!thickens) return near;
        SlabField field = thickened(near, walls, foot.above(grid, first), monitor.stop);
        foot.cut(grid, first, field);
        return field;
      },
      monitor);
  foot.flatten(result, step);
  return result;
}

struct HollowMesh {
  TriangleMesh mesh;
  double cavity;  ///< volume
};

HollowMesh hollowed(const TriangleMesh& mesh, const PrintOptions& options, double edge,
                    const Foot& foot, const ProgressMonitor& monitor) {
  const double shell = std::max(*options.shell, kShellSlack * options.min_wall.value_or(0));
  double step = std::min(edge, shell / kStepsACavityWall);
  if (options.drain > 0) step = std::min(step, options.drain / kStepsADrain);
  const Cavity cavity(mesh, shell, options.drain, monitor.stop);
  const double narrowest = mesh.box().size().head<2>().minCoeff();
  if (options.drain > kWidestDrain * narrowest) {
    throw OptionError("drain", fmt::format("a hole of {:.4g} is too wide for a mesh that is {:.4g} "
                                           "across; give a smaller one, or 0 for none",
                                           options.drain, narrowest));
  }
  const Grid grid = checked_grid(mesh, step, kHollowMargin, 0, foot, "shell");
  TriangleMesh result = meshed(
      mesh, grid, 0, "hollowing out",
      [&](SlabField near, int first) {
        for_each_point(near, monitor.stop, [&](std::size_t number, const Eigen::Vector3i& index) {
          if (near.values[number] >= 0) return;
          const Eigen::Vector3d x = grid.point(index + first * Eigen::Vector3i::UnitZ());
          const auto open = static_cast<float>(-cavity.at(x) / step);
          near.values[number] = std::max(near.values[number], open);
        });
        return near;
      },
      monitor);
  foot.flatten(result, step);
  return {std::move(result), cavity.volume()};
}

/// How the mesh has to be scaled for the size that is asked for, when its foot will be cut off.
double scale_for(const Eigen::Vector3d& size, const PrintOptions& options) {
  const double foot = options.flat_foot.value_or(0);
  if (options.height) return (*options.height + foot) / size.z();
  if (!options.longest) return 1;
  return std::min({*options.longest / size.x(), *options.longest / size.y(),
                   (*options.longest + foot) / size.z()});
}

/// How far the mesh is from the requested size.
double size_correction(const TriangleMesh& mesh, const PrintOptions& options) {
  const Eigen::Vector3d size = mesh.box().size();
  if (options.height) return *options.height / size.z();
  if (options.longest) return *options.longest / size.maxCoeff();
  return 1;
}

void expect_solid(const TriangleMesh& mesh) {
  const MeshReport report = inspect(mesh);
  if (!report.closed()) {
    throw InputError(
        fmt::format("the surface has {} open and {} non-manifold edges; only a closed one has "
                    "walls, a foot and an inside",
                    report.open_edges, report.non_manifold_edges));
  }
  if (!(signed_volume(mesh) > 0)) {
    throw InputError("the surface encloses no volume, or is inside out; turn its triangles");
  }
}

void add_loose(const LoosePieces& pieces, LoosePieces& all) {
  all.count += pieces.count;
  all.volume += pieces.volume;
  all.share += pieces.share;
}

void expect_some(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) {
    throw OptionError("flat_foot", "nothing of the mesh is left; cut off less");
  }
}

/// What the scale has to be multiplied by, at which the foot that was cut off stays as it is.
double scale_correction(const TriangleMesh& mesh, const PrintOptions& options) {
  const Eigen::Vector3d size = mesh.box().size();
  const double wanted = options.height ? *options.height : options.longest.value_or(0);
  const bool is_upright = options.height || size.z() >= size.head<2>().maxCoeff();
  if (wanted == 0 || !is_upright) return size_correction(mesh, options);
  const double foot = options.flat_foot.value_or(0);
  return (wanted + foot) / (size.z() + foot);
}

/// The mesh with its walls and its foot.
struct Body {
  TriangleMesh mesh;
  LoosePieces loose;
  double scale = 1;                                           ///< of the mesh that it was made of
  double thinnest = std::numeric_limits<double>::infinity();  ///< wall, if walls are asked for

  void enlarge_by(double factor) {
    enlarge(mesh, factor);
    loose.volume *= std::pow(factor, 3);
    scale *= factor;
    thinnest *= factor;
  }
};

/// What decimations leave of walls.
class WallLoss {
 public:
  /// How thick walls have to be so that `wall` is left of them, by the line through the last two
  /// decimations; infinite where thicker walls leave no more. After one decimation, as if all
  /// walls lost the same.
  /// @param before, left the wall that the last decimation was given, and what it left of it.
  double wall_for(double wall, double before, double left) {
    const double slope = count_ == 0 ? 1 : (left - left_) / (before - before_);
    before_ = before, left_ = left;
    ++count_;
    return slope > 0 ? before + (wall - left) / slope : std::numeric_limits<double>::infinity();
  }
  /// The most that walls may be thickened for it, over the least wall.
  double most() const { return count_ < 2 ? kThickestAtFirst : kThickestLater; }

 private:
  double before_ = 0, left_ = 0;
  int count_ = 0;
};

/// A mesh on its way to the printer.
///
/// Thicker walls make the mesh longer, and scaling it back to its size makes them thinner; and
/// where parts that were thickened meet, new thin ones appear. So the body is thickened, scaled to
/// its size, and thickened again where it is still too thin. What is thick enough stays as it is,
/// so that few tries are needed. Only a body that has its walls at its size is hollowed out and
/// decimated.
class PrintJob {
 public:
  /// @param mesh stands upright along z.
  PrintJob(TriangleMesh mesh, const PrintOptions& options, const ProgressMonitor& monitor)
      : mesh_(std::move(mesh)),
        options_(options),
        monitor_(monitor),
        wall_(options.min_wall.value_or(0)),
        wanted_(wall_ * (decimates() ? kDecimationSlack : 1)),
        thinnest_before_(wall_ > 0 ? wall_thickness(mesh_, monitor_.stop).thinnest : 0),
        mean_edge_(mean_edge_of(mesh_)),
        volume_(signed_volume(mesh_)) {}

  PrintMesh run() {
    const double scale = scale_for(mesh_.box().size(), options_);
    double radius = scale * thinnest_before_ < wall_ ? kFirstRadius * wanted_ : 0;
    Body body = scaled_body(scale);
    make_solid(body, radius, options_.flat_foot);
    const double correction = scale_correction(body.mesh, options_);
    if (options_.flat_foot && std::abs(correction - 1) > kFootSlack) {
      body = scaled_body(scale * correction);
      make_solid(body, radius, options_.flat_foot);
    }
    std::optional<double> plane;
    if (options_.flat_foot) plane = 0;
    double thinnest = 0;
    WallLoss loss;
    for (int i = 1;; ++i) {
      body.enlarge_by(size_correction(body.mesh, options_));
      thinnest = body.thinnest;
      double wanted = wanted_, most = leaves_few(body.scale) ? kMostGrowthForFew : kMostGrowth;
      if (thinnest >= (radius > 0 ? wanted_ : wall_)) {
        PrintMesh made = finished(body);
        if (made.report.thinnest >= wall_) return made;
        const double left = made.report.thinnest;
        wanted = loss.wall_for(wall_, thinnest, left);
        if (!(wanted <= loss.most() * wall_)) throw too_few_triangles(left);
        most = kMostGrowthForFew;
      }
      if (i == kMostPrintSteps) break;
      radius = radius == 0 ? kFirstRadius * wanted_
                           : radius * std::clamp(wanted / thinnest, kLeastGrowth, most);
      make_solid(body, radius, plane);
    }
    throw Error(fmt::format(
        "a hundredth of the surface stays thinner than {:.4g} after {} tries, and a wall of {} was "
        "asked for; {}{}ask for a thinner wall or a larger print",
        thinnest, kMostPrintSteps, wall_,
        options_.flat_foot
            ? "cut the foot at another height, since it also cuts thickened walls, or "
            : "",
        decimates() ? "allow more triangles or a smaller error, or " : ""));
  }

 private:
  /// Thicker walls before the decimation do not help, or too little.
  Error too_few_triangles(double thinnest) const {
    return Error(fmt::format(
        "walls are {} thick, but with so few triangles a hundredth of the surface has walls "
        "thinner than {:.4g}; allow more triangles or a smaller error, or ask for a thinner wall",
        wall_, thinnest));
  }

  bool decimates() const { return options_.max_triangles || options_.max_error; }

  double thinnest_of(const TriangleMesh& mesh) const {
    return wall_thickness(mesh, monitor_.stop).thinnest / kWallSlack;
  }

  double edge_of(const TriangleMesh& mesh, double scale) const {
    return std::min(scale * mean_edge_, mesh.box().size().maxCoeff() / kFewestCells);
  }

  /// Whether the triangles that decimation leaves are large beside the least wall.
  bool leaves_few(double scale) const {
    if (!options_.max_triangles) return false;
    const auto before = static_cast<double>(mesh_.triangles.size());
    const auto after = static_cast<double>(*options_.max_triangles);
    return scale * mean_edge_ * std::sqrt(before / after) > kLongEdge * wall_;
  }

  Body scaled_body(double scale) const {
    Body body{mesh_, {}, 1};
    body.enlarge_by(scale);
    return body;
  }

  /// Cuts a foot of that height off, if any, and puts balls of that radius into thin walls.
  void make_solid(Body& body, double radius, std::optional<double> foot) {
    const int most = (wall_ > 0 ? kMostPrintSteps : 1) + (options_.flat_foot ? 1 : 0);
    ++steps_;
    ProgressMonitor monitor = monitor_;
    monitor.on_progress = [&](Progress progress) {
      progress.detail = fmt::format("step {} of at most {}", steps_, most);
      monitor_.report(progress);
    };
    const Box box = body.mesh.box();
    if (foot && box.low.z() + *foot >= box.high.z()) expect_some({});
    if (radius > 0 || foot) {
      std::optional<double> height;
      if (foot) height = box.low.z() + *foot;
      double step = edge_of(body.mesh, body.scale);
      if (radius > 0) {
        const double fewest = leaves_few(body.scale) ? kStepsAWallOfFew : kStepsAWall;
        step = std::clamp(step, wall_ / kMostStepsAWall, wall_ / fewest);
      }
      body.mesh = solid_of(body.mesh, radius, wall_, step, Foot(height), monitor);
    }
    if (!options_.keep_loose) add_loose(drop_loose_pieces(body.mesh), body.loose);
    expect_some(body.mesh);
    if (wall_ > 0) body.thinnest = thinnest_of(body.mesh);
  }

  /// The body at its size, hollowed out and decimated.
  PrintMesh finished(Body body) const {
    PrintMesh made{std::move(body.mesh), {}};
    PrintReport& report = made.report;
    report.loose = body.loose;
    report.thinnest = wall_ > 0 ? body.thinnest : 0;
    if (options_.shell) {
      hollow(made, edge_of(made.mesh, body.scale));
      if (wall_ > 0) {
        report.thinnest = thinnest_of(made.mesh);
        const double thinnest = size_correction(made.mesh, options_) * report.thinnest;
        if (thinnest < wall_) {
          throw OptionError("shell",
                            fmt::format("with a cavity, a hundredth of the surface has walls "
                                        "thinner than {:.4g}, and a wall of {} was asked for; give "
                                        "a thicker shell, or a narrower drain",
                                        thinnest, wall_));
        }
      }
    }
    if (decimates()) {
      monitor_.report({"decimating", -1, -1, {}});
      Decimation found = decimate(std::move(made.mesh),
                                  {options_.max_triangles, options_.max_error}, monitor_.stop);
      made.mesh = std::move(found.mesh);
      report.decimation = found.report;
      if (wall_ > 0) report.thinnest = thinnest_of(made.mesh);
    }
    const double last = size_correction(made.mesh, options_);
    enlarge(made.mesh, last);
    report.scale = last * body.scale;
    report.thinnest *= last;
    if (report.decimation) report.decimation->farthest *= last;
    report.thinnest_before = report.scale * thinnest_before_;
    report.volume = std::pow(report.scale, 3) * volume_;
    report.printed_volume = signed_volume(made.mesh);
    return made;
  }

  /// @param edge of triangles.
  void hollow(PrintMesh& made, double edge) const {
    std::optional<double> height;
    if (options_.flat_foot) height = made.mesh.box().low.z();
    auto [mesh, cavity] = hollowed(made.mesh, options_, edge, Foot(height), monitor_);
    made.mesh = std::move(mesh);
    made.report.cavity = cavity;
    // A closed cavity is a part of its own, which is not loose.
    if (options_.drain > 0 && !options_.keep_loose) {
      add_loose(drop_loose_pieces(made.mesh), made.report.loose);
    }
    expect_some(made.mesh);
  }

  TriangleMesh mesh_;
  const PrintOptions& options_;
  const ProgressMonitor& monitor_;
  double wall_;
  double wanted_;                                ///< wall, before decimation
  double thinnest_before_, mean_edge_, volume_;  ///< of `mesh_`
  int steps_ = 0;                                ///< that cut the foot or thickened walls
};

}  // namespace

void PrintOptions::validate() const {
  expect_in_ranges(print_settings(), *this);
  if (max_triangles || max_error) DecimateOptions{max_triangles, max_error}.validate();
  if (height && longest) {
    throw InputError("height and longest contradict each other; give one of them");
  }
  if (shell && min_wall && *shell < *min_wall) {
    throw OptionError("shell", fmt::format("{} is thinner than the least wall, {}; give a thicker "
                                           "shell or a thinner wall",
                                           *shell, *min_wall));
  }
}

bool PrintOptions::is_any() const {
  return height || longest || min_wall || flat_foot || shell || max_triangles || max_error;
}

PrintMesh made_printable(TriangleMesh mesh, const PrintOptions& options,
                         const ProgressMonitor& monitor) {
  options.validate();
  mesh.validate();
  if (mesh.triangles.empty()) throw InputError("the mesh has no triangles");
  if (options.min_wall || options.flat_foot || options.shell) expect_solid(mesh);
  const Eigen::Matrix3d upright = quarter_turns(options.up, UpAxis::z);
  turn_mesh(mesh, upright);
  if (!(mesh.box().size().minCoeff() > 0))
    throw InputError("the mesh is flat; give one with a volume");
  PrintMesh made = PrintJob(std::move(mesh), options, monitor).run();
  turn_mesh(made.mesh, upright.transpose());
  return made;
}

}  // namespace qjulia
