#include <algorithm>
#include <cmath>
#include <numeric>

#include "device/context.hpp"
#include "qjulia/error.hpp"
#include "qjulia/shape.hpp"
#include "shape/bvh.hpp"
#include "shape/morton.hpp"

namespace qjulia {

using device::Context;

namespace {

/// beta of Barill et al.: a dipole stands for triangles seen from this many radii away.
constexpr double kDipoleAccuracy = 2;
/// Points per launch: keeps a launch near 100 ms.
constexpr std::size_t kBlock = std::size_t{1} << 16;
/// Points per work-group. Fixed, since some compilers build a kernel anew for each group size.
constexpr std::size_t kWorkGroupPoints = 64;

/// Moves the box of the mesh to about [-1, 1]^3, where single precision is at its best.
ShapeToMap unit_frame(const TriangleMesh& mesh) {
  const Box box = mesh.box();
  const double side = box.size().maxCoeff();
  if (mesh.triangles.empty() || !std::isfinite(side) || side <= 0) {
    throw InputError("the mesh has no extent; give a mesh with triangles");
  }
  const double scale = 2 / side;
  return {scale, -scale * box.center()};
}

TriangleMesh in_frame(TriangleMesh mesh, const ShapeToMap& frame) {
  for (auto& x : mesh.vertices) x = frame.to_map(x);
  return turned_outward(std::move(mesh));
}

}  // namespace

struct SignedDistance::Impl {
  Device device;
  Precision precision;
  ShapeToMap frame;  ///< mesh units to the device's
  device::RealBuffer nodes;
  device::Buffer<std::int32_t> links;
  device::RealBuffer triangles;

  Impl(const Device& on, const TriangleMesh& mesh, Precision at)
      : device(on), precision(at), frame(unit_frame(mesh)) {
    const Bvh bvh(in_frame(mesh, frame), kDipoleAccuracy);
    Context& context = device.context();
    nodes = context.upload_real(bvh.nodes, precision);
    links = context.upload(std::span(bvh.links));
    triangles = context.upload_real(bvh.triangles, precision);
  }

  std::vector<double> run(const char* kernel, std::span<const Eigen::Vector3d> points,
                          std::span<const std::uint32_t> order) const;
  std::vector<std::uint32_t> spatial_order(std::span<const Eigen::Vector3d> points) const;
};

/// Neighbours in space side by side, so that the lanes of a work-item open the same nodes.
std::vector<std::uint32_t> SignedDistance::Impl::spatial_order(
    std::span<const Eigen::Vector3d> points) const {
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

/// Results in the order of `points`; they are handed to the device in the order given.
std::vector<double> SignedDistance::Impl::run(const char* name,
                                              std::span<const Eigen::Vector3d> points,
                                              std::span<const std::uint32_t> order) const {
  Context& context = device.context();
  const int width = device.lane_width(precision);
  const auto lanes = static_cast<std::size_t>(width);
  const auto kernel = context.kernel("signed_distance.cl", name, {width, precision, {}});
  std::vector<double> results(points.size());
  for (std::size_t first = 0; first < order.size(); first += kBlock) {
    const auto block = order.subspan(first, std::min(kBlock, order.size() - first));
    const std::size_t groups = (block.size() + lanes - 1) / lanes;
    const std::size_t stride = groups * lanes;
    std::vector<double> coordinates(3 * stride);
    for (std::size_t i = 0; i < stride; ++i) {
      const Eigen::Vector3d x = frame.to_map(points[block[std::min(i, block.size() - 1)]]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        coordinates[axis * stride + i] = x[static_cast<Eigen::Index>(axis)];
      }
    }
    const auto out = context.allocate_real(stride, precision);
    const std::size_t local = std::max<std::size_t>(kWorkGroupPoints / lanes, 1);
    const std::size_t global = (groups + local - 1) / local * local;
    context.launch(kernel, {{global, 1, 1}, {local, 1, 1}},
                   {context.upload_real(coordinates, precision), static_cast<std::int32_t>(stride),
                    static_cast<std::int32_t>(groups), nodes, links, triangles, out});
    std::vector<double> values(block.size());
    context.read(out, values);
    for (std::size_t i = 0; i < block.size(); ++i) results[block[i]] = values[i];
  }
  return results;
}

SignedDistance::SignedDistance(const Device& device, const TriangleMesh& mesh, Precision precision)
    : impl_(std::make_shared<Impl>(device, mesh, precision)) {}

std::vector<double> SignedDistance::at(std::span<const Eigen::Vector3d> points) const {
  const auto order = impl_->spatial_order(points);
  std::vector<double> distances = impl_->run("nearest_distance", points, order);
  const std::vector<double> windings = impl_->run("winding_number", points, order);
  for (std::size_t i = 0; i < points.size(); ++i) {
    distances[i] /= windings[i] > 0.5 ? -impl_->frame.scale : impl_->frame.scale;
  }
  return distances;
}

std::vector<double> SignedDistance::winding_numbers(std::span<const Eigen::Vector3d> points) const {
  return impl_->run("winding_number", points, impl_->spatial_order(points));
}

}  // namespace qjulia
