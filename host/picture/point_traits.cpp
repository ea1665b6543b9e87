#include "picture/point_traits.hpp"

#include <utility>

#include "base/srgb.hpp"
#include "picture/orbit_traits.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia::picture {

PointTraits::PointTraits(const Device& device, const Map& map, const SurfaceColorOptions& options,
                         std::stop_token stop)
    : coloring_{options.material, direction(map.frame.up.value_or(kDefaultUp)),
                map.frame.shape_to_map},
      map_(device, map, find_stop_radii(device, map, options.escape, stop), options.precision),
      iterations_(options.iterations),
      stop_(std::move(stop)) {}

std::vector<float> PointTraits::operator()(std::span<const Eigen::Vector3d> points,
                                           std::span<const double> widths) const {
  std::vector<Eigen::Vector3d> in_map;
  in_map.reserve(points.size());
  for (const Eigen::Vector3d& x : points) in_map.push_back(coloring_.to_scene.to_map(x));
  const OrbitsTell orbits = [&](const auto& some, auto diameters) {
    return orbit_traits(map_, some, diameters, iterations_, coloring_.material, stop_);
  };
  return material_traits(orbits, coloring_, in_map, widths);
}

VertexColor vertex_color(const Palette& palette, const MaterialRange& range, float trait) {
  const Rgb color = color_at(palette, share_of(range, double{trait}));
  VertexColor bytes;
  for (std::size_t c = 0; c < bytes.size(); ++c) {
    bytes[c] = base::byte_of(base::srgb_encoded(color[static_cast<Eigen::Index>(c)]));
  }
  return bytes;
}

}  // namespace qjulia::picture
