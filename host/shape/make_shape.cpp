#include <cmath>
#include <utility>

#include "qjulia/error.hpp"
#include "qjulia/shape.hpp"

namespace qjulia {

Shape make_shape(const Device& device, const TriangleMesh& mesh) {
  constexpr double kLongestSide = 3;
  constexpr double kLeastVolume = 1e-7;  // over the longest side cubed
  Shape shape;
  shape.box = mesh.box();
  if (std::abs(signed_volume(mesh)) <= kLeastVolume * std::pow(shape.box.size().maxCoeff(), 3)) {
    throw InputError("the mesh encloses no volume: it is flat; give a mesh with an inside");
  }
  OuterSurface outer = outer_surface(device, turned_outward(mesh));
  shape.mesh = std::move(outer.mesh);
  shape.has_hidden_parts = outer.leaves_out;
  const DeepestPoint deepest = deepest_interior_point(outer.distance, shape.box);
  const double scale = kLongestSide / shape.box.size().maxCoeff();
  shape.shape_to_map = {scale, -scale * deepest.position};
  shape.inradius = scale * deepest.inradius;
  for (auto& x : shape.mesh.vertices) x = shape.shape_to_map.to_map(x);
  return shape;
}

}  // namespace qjulia
