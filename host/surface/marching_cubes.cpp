#include "surface/marching_cubes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <utility>

#include "surface/cube_cases.hpp"

namespace qjulia::surface {

MarchingCubes::MarchingCubes(const Eigen::Vector3i& points, double level,
                             const DifferenceScale& scale)
    : points_(points),
      nx_(static_cast<std::size_t>(points[0])),
      ny_(static_cast<std::size_t>(points[1])),
      level_(static_cast<float>(level)),
      reach_(static_cast<float>(scale.reach)),
      flatten_(static_cast<float>(1 / scale.steepness)),
      on_z_(nx_ * ny_) {
  for (Slice* slice : {&lower_, &upper_}) {
    slice->difference.resize(nx_ * ny_);
    slice->inside.resize(nx_ * ny_);
    slice->on_x.resize(nx_ * ny_);
    slice->on_y.resize(nx_ * ny_);
  }
}

void MarchingCubes::add(std::span<const float> slice, const Slab& slab) {
  std::swap(lower_, upper_);
  ++slices_;
  upper_.slab = &slab;
  classify(slice);
  part_.complete = next_vertex();
  cross_slice();
  if (slices_ == 1) return;
  cross_between();
  mesh_layer();
}

MeshPart MarchingCubes::take() {
  if (slices_ == points_[2]) part_.complete = next_vertex();
  MeshPart next;
  next.first = next_vertex();
  return std::exchange(part_, std::move(next));
}

void MarchingCubes::classify(std::span<const float> values) {
  for (std::size_t y = 0; y < ny_; ++y) {
    for (const PointRun& run : upper_.slab->row(static_cast<int>(y))) {
      const std::size_t first = y * nx_ + static_cast<std::size_t>(run.begin);
      const std::size_t end = y * nx_ + static_cast<std::size_t>(run.end);
      if (run.side != Side::unknown) {
        std::fill_n(&upper_.inside[first], end - first,
                    static_cast<std::uint8_t>(run.side == Side::inside));
        continue;
      }
      for (std::size_t i = first; i < end; ++i) {
        upper_.inside[i] = values[i] < level_ ? 1 : 0;
        const float over = values[i] - level_;
        upper_.difference[i] = std::clamp(over > 0 ? flatten_ * over : over, -reach_, reach_);
      }
    }
  }
}

std::uint32_t MarchingCubes::crossing(std::size_t index, int z, int axis, float at_start,
                                      float at_end) {
  if (part_.first + part_.vertices.size() >= std::numeric_limits<std::uint32_t>::max()) {
    throw Error("the surface has more than 4294967294 vertices; lower the resolution");
  }
  const std::uint32_t number = next_vertex();
  EdgeVertex vertex{{static_cast<int>(index % nx_), static_cast<int>(index / nx_), z}, axis};
  vertex.at_start = at_start;
  vertex.at_end = at_end;
  vertex.put(at_start / (at_start - at_end));
  part_.vertices.push_back(vertex);
  return number;
}

void MarchingCubes::cross_slice() {
  const int z = slices_ - 1;
  const auto& inside = upper_.inside;
  const auto& difference = upper_.difference;
  each_unknown(*upper_.slab, points_, [&](std::size_t first, std::size_t count) {
    const std::size_t y = first / nx_;
    const std::size_t row_end = (y + 1) * nx_;
    for (std::size_t i = first; i < first + count; ++i) {
      if (i + 1 < row_end && inside[i] != inside[i + 1]) {
        upper_.on_x[i] = crossing(i, z, 0, difference[i], difference[i + 1]);
      }
      if (y + 1 < ny_ && inside[i] != inside[i + nx_]) {
        upper_.on_y[i] = crossing(i, z, 1, difference[i], difference[i + nx_]);
      }
    }
  });
}

void MarchingCubes::cross_between() {
  each_unknown(*lower_.slab, points_, [&](std::size_t first, std::size_t count) {
    for (std::size_t i = first; i < first + count; ++i) {
      if (lower_.inside[i] != upper_.inside[i]) {
        on_z_[i] = crossing(i, slices_ - 2, 2, lower_.difference[i], upper_.difference[i]);
      }
    }
  });
}

void MarchingCubes::mesh_layer() {
  each_unknown(*lower_.slab, points_, [&](std::size_t first, std::size_t count) {
    const std::size_t y = first / nx_;
    if (y + 1 == ny_) return;
    // The four corners at one x: bits 0, 2, 4, 6 of a case.
    const auto column = [&](std::size_t i) {
      return static_cast<unsigned>(lower_.inside[i] | lower_.inside[i + nx_] << 2 |
                                   upper_.inside[i] << 4 | upper_.inside[i + nx_] << 6);
    };
    const std::size_t end = std::min(first + count, (y + 1) * nx_ - 1);
    unsigned left = column(first);
    for (std::size_t i = first; i < end; ++i) {
      const unsigned right = column(i + 1);
      const unsigned inside = left | right << 1;
      if (inside != 0 && inside != 255) mesh_cell(inside, i);
      left = right;
    }
  });
}

void MarchingCubes::mesh_cell(unsigned inside, std::size_t i) {
  // In the order of cube_edges().
  const std::array<const std::uint32_t*, 12> on_edge{
      &lower_.on_x[i], &lower_.on_x[i + nx_], &upper_.on_x[i], &upper_.on_x[i + nx_],
      &lower_.on_y[i], &lower_.on_y[i + 1],   &upper_.on_y[i], &upper_.on_y[i + 1],
      &on_z_[i],       &on_z_[i + 1],         &on_z_[i + nx_], &on_z_[i + nx_ + 1]};
  for (const CubeLoop& loop : cube_cases()[inside]) {
    for (std::size_t t = 0; t < loop.triangles.size(); t += 3) {
      part_.triangles.push_back({*on_edge[loop.triangles[t]], *on_edge[loop.triangles[t + 1]],
                                 *on_edge[loop.triangles[t + 2]]});
    }
  }
  const Eigen::Vector3i cell(static_cast<int>(i % nx_), static_cast<int>(i / nx_), slices_ - 2);
  for (int axis = 0; axis < 3; ++axis) {
    if (cell[axis] == 0) part_.open_edges += face_segments(inside, 2 * axis).size();
    if (cell[axis] == points_[axis] - 2) {
      part_.open_edges += face_segments(inside, 2 * axis + 1).size();
    }
  }
}

void MeshBuilder::add(const MeshPart& part) {
  for (const EdgeVertex& vertex : part.vertices) {
    positions_.push_back(shape_to_map_.to_shape(vertex.on(grid_)));
  }
  normals_.resize(positions_.size(), Eigen::Vector3d::Zero());
  const auto position = [&](std::uint32_t number) { return positions_[number - first_]; };
  for (const auto& [a, b, c] : part.triangles) {
    const Eigen::Vector3d origin = position(a);
    const Eigen::Vector3d area = (position(b) - origin).cross(position(c) - origin);
    for (const auto number : {a, b, c}) normals_[number - first_] += area;
  }
  triangles_ += part.triangles.size();
  sink_.triangles(part.triangles);

  const std::size_t done = part.complete - first_;
  for (std::size_t i = 0; i < done; ++i) normals_[i].normalize();
  sink_.vertices(std::span(positions_).first(done), std::span(normals_).first(done));
  const auto kept = static_cast<std::ptrdiff_t>(done);
  positions_.erase(positions_.begin(), positions_.begin() + kept);
  normals_.erase(normals_.begin(), normals_.begin() + kept);
  first_ = part.complete;
}

}  // namespace qjulia::surface
