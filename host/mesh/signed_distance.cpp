#include <algorithm>
#include <cmath>
#include <optional>

#include "device/launch_watch.hpp"
#include "device/point_batch.hpp"
#include "mesh/bvh.hpp"
#include "mesh/tree_walk.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/shape.hpp"

namespace qjulia {

using namespace shape;

using device::Argument;
using device::Context;
using device::narrow;
using device::PointBatch;

namespace {

/// beta of Barill et al.: a dipole stands for triangles seen from this many radii away.
constexpr double kDipoleAccuracy = 2;
/// What a point costs: about so many triangles and boxes are looked at for it.
constexpr double kPointCost = 1024;

/// Moves the box of the mesh to about [-1, 1]^3, where single precision is at its best.
ShapeToMap unit_frame(const TriangleMesh& mesh) {
  mesh.validate();
  const Box box = mesh.box();
  const double side = box.size().maxCoeff();
  if (mesh.triangles.empty() || !std::isfinite(side) || side <= 0) {
    throw InputError("the mesh has no extent; give a mesh with triangles");
  }
  const double scale = 2 / side;
  return {scale, -scale * box.center()};
}

TriangleMesh in_frame(TriangleMesh mesh, const ShapeToMap& frame, const std::stop_token& stop) {
  for (auto& x : mesh.vertices) x = frame.to_map(x);
  return oriented_outward(std::move(mesh), stop);
}

/// Spreads 21 bits to every third bit.
std::uint64_t spread(std::uint64_t v) {
  v = (v | v << 32) & 0x1f00000000ffffU;
  v = (v | v << 16) & 0x1f0000ff0000ffU;
  v = (v | v << 8) & 0x100f00f00f00f00fU;
  v = (v | v << 4) & 0x10c30c30c30c30c3U;
  return (v | v << 2) & 0x1249249249249249U;
}

/// Place of `x` on the Morton curve through [-1, 1]^3, 21 bits an axis. Points outside count as the
/// nearest one inside, and coordinates that are not numbers as -1.
std::uint64_t morton_code(const Eigen::Vector3d& x) {
  std::uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    constexpr double kCells = 0x1fffff;
    const double place = (x[axis] + 1) / 2 * kCells;
    const double cell = place > 0 ? std::min(place, kCells) : 0;
    code |= spread(static_cast<std::uint64_t>(cell)) << axis;
  }
  return code;
}

}  // namespace

struct SignedDistance::Impl {
  Device device;
  Precision precision;
  ShapeToMap frame;  ///< mesh units to the device's
  device::RealBuffer nodes;
  device::Buffer<std::int32_t> links;
  device::RealBuffer triangles;
  std::optional<Bvh> counted;  ///< kept where launches are watched

  Impl(const Device& on, const TriangleMesh& mesh, Precision at, const std::stop_token& stop)
      : device(on), precision(at), frame(unit_frame(mesh)) {
    Bvh bvh(in_frame(mesh, frame, stop), kDipoleAccuracy, stop);
    Context& context = device.context();
    nodes = context.upload_real(bvh.nodes, precision);
    links = context.upload(std::span<const std::int32_t>(bvh.links));
    triangles = context.upload_real(bvh.triangles, precision);
    if (device::launch_watch() != nullptr) counted = std::move(bvh);
  }

  /// Neighbours in space side by side, so that the lanes of a work-item open the same nodes.
  std::vector<std::uint32_t> spatial_order(std::span<const Eigen::Vector3d> points) const {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
    keys.reserve(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      keys.emplace_back(morton_code(frame.to_map(points[i]) / 2), i);
    }
    std::ranges::sort(keys);
    std::vector<std::uint32_t> order(points.size());
    std::ranges::transform(keys, order.begin(), [](const auto& key) { return key.second; });
    return order;
  }

  /// Tells the watch what the kernel will look at, as far as a sample of its work-items shows.
  void count_walks(const std::string& name, std::span<const Eigen::Vector3d> points,
                   std::span<const std::uint32_t> order, std::size_t width) const {
    device::LaunchWatch* const watch = device::launch_watch();
    if (watch == nullptr || !counted || order.empty()) return;
    constexpr std::size_t kSampled = 64;
    const bool is_nearest = name == "nearest_distance";
    const std::size_t items = (order.size() + width - 1) / width;
    const std::size_t sampled = std::min(items, kSampled);
    TreeWalk all;
    for (std::size_t s = 0; s < sampled; ++s) {
      std::vector<std::array<double, 3>> at;
      for (std::size_t i = s * items / sampled * width; at.size() < width; ++i) {
        const Eigen::Vector3d x = frame.to_map(points[order[std::min(i, order.size() - 1)]]);
        at.push_back({x.x(), x.y(), x.z()});
      }
      const TreeWalk walk = is_nearest ? nearest_walk(*counted, at) : winding_walk(*counted, at);
      all.boxes += walk.boxes, all.triangles += walk.triangles;
    }
    const double lanes = static_cast<double>(items * width) / static_cast<double>(sampled);
    const double slots = all.boxes * (is_nearest ? kBoxSlots : kDipoleSlots) +
                         all.triangles * (is_nearest ? kTriangleSlots : kAngleSlots);
    watch->did(name, lanes * slots);
  }

  /// Results in the order of `points`; they are handed to the device in the order given.
  std::vector<double> run(const char* name, std::span<const Eigen::Vector3d> points,
                          std::span<const std::uint32_t> order, const std::stop_token& stop) const {
    const int width = device.lane_width(precision);
    PointBatch batch(device.context(),
                     device.context().kernel("signed_distance.cl", name, {width, precision, {}}),
                     precision, static_cast<std::size_t>(width), kPointCost);
    std::vector<double> results(points.size());
    count_walks(name, points, order, static_cast<std::size_t>(width));
    batch.run<3, 1>(
        order.size(),
        [&](std::size_t i) {
          const Eigen::Vector3d x = frame.to_map(points[order[i]]);
          return std::array{x.x(), x.y(), x.z()};
        },
        [&](const PointBatch::Part& part) {
          return device::PartCall{
              {part.in, narrow(part.stride), narrow(part.items), nodes, links, triangles, part.out},
              device::moving(4 * static_cast<double>(part.stride))};
        },
        [&](std::size_t i, const std::array<double, 1>& value) { results[order[i]] = value[0]; }, 0,
        stop);
    return results;
  }
};

SignedDistance::SignedDistance(const Device& device, const TriangleMesh& mesh, Precision precision,
                               std::stop_token stop)
    : impl_(std::make_shared<Impl>(device, mesh, precision, stop)) {}

std::vector<double> SignedDistance::at(std::span<const Eigen::Vector3d> points,
                                       const std::stop_token& stop) const {
  const auto order = impl_->spatial_order(points);
  std::vector<double> distances = impl_->run("nearest_distance", points, order, stop);
  const std::vector<double> windings = impl_->run("winding_number", points, order, stop);
  for (std::size_t i = 0; i < points.size(); ++i) {
    distances[i] /= windings[i] > 0.5 ? -impl_->frame.scale : impl_->frame.scale;
  }
  return distances;
}

std::vector<double> SignedDistance::winding_numbers(std::span<const Eigen::Vector3d> points,
                                                    const std::stop_token& stop) const {
  return impl_->run("winding_number", points, impl_->spatial_order(points), stop);
}

}  // namespace qjulia
