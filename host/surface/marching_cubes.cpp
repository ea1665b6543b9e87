#include "surface/marching_cubes.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "qjulia/error.hpp"
#include "surface/cube_cases.hpp"

namespace qjulia {
namespace {

/// Vertices keep this far from grid points, in steps: no two of them coincide.
constexpr float kMargin = 0.01F;

}  // namespace

MarchingCubes::MarchingCubes(int nx, int ny, double level, double reach)
    : nx_(static_cast<std::size_t>(nx)),
      ny_(static_cast<std::size_t>(ny)),
      level_(static_cast<float>(level)),
      reach_(static_cast<float>(reach)),
      on_z_(nx_ * ny_) {
  for (Slice* slice : {&lower_, &upper_}) {
    slice->difference.resize(nx_ * ny_);
    slice->inside.resize(nx_ * ny_);
    slice->on_x.resize(nx_ * ny_);
    slice->on_y.resize(nx_ * ny_);
  }
}

void MarchingCubes::add(std::span<const float> slice) {
  std::swap(lower_, upper_);
  ++slices_;
  classify(slice, upper_);
  cross_slice(upper_);
  if (slices_ == 1) return;
  cross_between();
  mesh_layer();
}

void MarchingCubes::classify(std::span<const float> values, Slice& slice) const {
  for (std::size_t i = 0; i < values.size(); ++i) {
    slice.inside[i] = values[i] < level_ ? 1 : 0;
    slice.difference[i] = std::clamp(values[i] - level_, -reach_, reach_);
  }
}

Eigen::Vector3d MarchingCubes::point(std::size_t index, int z) const {
  const std::size_t x = index % nx_;
  const std::size_t y = index / nx_;
  return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

std::uint32_t MarchingCubes::add_vertex(const Eigen::Vector3d& position) {
  const std::size_t number = mesh_.vertices.size();
  if (number >= std::numeric_limits<std::uint32_t>::max()) {
    throw Error("the surface has more than 4294967295 vertices; lower the resolution");
  }
  mesh_.vertices.push_back(position);
  return static_cast<std::uint32_t>(number);
}

std::uint32_t MarchingCubes::crossing(const Eigen::Vector3d& from, int axis, float below,
                                      float above) {
  float t = below / (below - above);
  if (!(t >= kMargin)) t = kMargin;  // also where a difference is not a number
  t = std::min(t, 1 - kMargin);
  return add_vertex(from + static_cast<double>(t) * Eigen::Vector3d::Unit(axis));
}

void MarchingCubes::cross_slice(Slice& slice) {
  const int z = slices_ - 1;
  const auto& inside = slice.inside;
  for (std::size_t y = 0; y < ny_; ++y) {
    for (std::size_t x = 0; x < nx_; ++x) {
      const std::size_t i = y * nx_ + x;
      if (x + 1 < nx_ && inside[i] != inside[i + 1]) {
        slice.on_x[i] = crossing(point(i, z), 0, slice.difference[i], slice.difference[i + 1]);
      }
      if (y + 1 < ny_ && inside[i] != inside[i + nx_]) {
        slice.on_y[i] = crossing(point(i, z), 1, slice.difference[i], slice.difference[i + nx_]);
      }
    }
  }
}

void MarchingCubes::cross_between() {
  for (std::size_t i = 0; i < nx_ * ny_; ++i) {
    if (lower_.inside[i] != upper_.inside[i]) {
      on_z_[i] = crossing(point(i, slices_ - 2), 2, lower_.difference[i], upper_.difference[i]);
    }
  }
}

void MarchingCubes::mesh_layer() {
  for (std::size_t y = 0; y + 1 < ny_; ++y) {
    const std::size_t row = y * nx_;
    // The four corners at one x: bits 0, 2, 4, 6 of a case.
    const auto column = [&](std::size_t i) {
      return static_cast<unsigned>(lower_.inside[i] | lower_.inside[i + nx_] << 2 |
                                   upper_.inside[i] << 4 | upper_.inside[i + nx_] << 6);
    };
    unsigned left = column(row);
    for (std::size_t i = row; i + 1 < row + nx_; ++i) {
      const unsigned right = column(i + 1);
      const unsigned inside = left | right << 1;
      if (inside != 0 && inside != 255) mesh_cell(inside, i);
      left = right;
    }
  }
}

void MarchingCubes::mesh_cell(unsigned inside, std::size_t corner) {
  const std::size_t i = corner;
  // In the order of cube_edges().
  const std::array<const std::uint32_t*, 12> on_edge{
      &lower_.on_x[i], &lower_.on_x[i + nx_], &upper_.on_x[i], &upper_.on_x[i + nx_],
      &lower_.on_y[i], &lower_.on_y[i + 1],   &upper_.on_y[i], &upper_.on_y[i + 1],
      &on_z_[i],       &on_z_[i + 1],         &on_z_[i + nx_], &on_z_[i + nx_ + 1]};
  for (const CubeLoop& loop : cube_cases()[inside]) {
    std::uint32_t center = 0;
    if (std::ranges::find(loop.triangles, kLoopCenter) != loop.triangles.end()) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const auto edge : loop.edges) mean += mesh_.vertices[*on_edge[edge]];
      center = add_vertex(mean / static_cast<double>(loop.edges.size()));
    }
    const auto vertex = [&](std::uint8_t edge) {
      return edge == kLoopCenter ? center : *on_edge[edge];
    };
    for (std::size_t t = 0; t < loop.triangles.size(); t += 3) {
      mesh_.triangles.push_back({vertex(loop.triangles[t]), vertex(loop.triangles[t + 1]),
                                 vertex(loop.triangles[t + 2])});
    }
  }
}

}  // namespace qjulia
