#include "mesh/half_edge_mesh.hpp"

#include <algorithm>
#include <limits>

#include "qjulia/base/progress.hpp"

namespace qjulia::shape {

// ---- the mesh ----

bool HalfEdgeMesh::is_collapse_ok(HalfedgeHandle edge) {
  const HalfedgeHandle back = opposite_halfedge_handle(edge);
  const VertexHandle gone = to_vertex_handle(back), kept = to_vertex_handle(edge);
  if (status(edge_handle(edge)).deleted() || status(gone).deleted() || status(kept).deleted()) {
    return false;
  }
  if (is_ear(edge) || is_ear(back)) return false;
  const VertexHandle left = apex(edge), right = apex(back);
  if (left == right) return false;
  neighbors_.clear();
  for (const VertexHandle v : vv_range(kept)) neighbors_.push_back(v);
  for (const VertexHandle v : vv_range(gone)) {
    if (v != left && v != right && std::ranges::find(neighbors_, v) != neighbors_.end()) {
      return false;
    }
  }
  const bool joins_borders = is_boundary(gone) && is_boundary(kept);
  return !joins_borders || is_boundary(edge) || is_boundary(back);
}

HalfEdgeMesh::HalfedgeHandle HalfEdgeMesh::find_halfedge(VertexHandle from, VertexHandle to) const {
  for (const HalfedgeHandle edge : voh_range(from)) {
    if (to_vertex_handle(edge) == to) return edge;
  }
  return HalfedgeHandle();
}

/// Whether the triangle beside the half-edge has no other neighbours.
bool HalfEdgeMesh::is_ear(HalfedgeHandle edge) const {
  if (is_boundary(edge)) return false;
  const HalfedgeHandle next = next_halfedge_handle(edge);
  return is_boundary(opposite_halfedge_handle(next)) &&
         is_boundary(opposite_halfedge_handle(next_halfedge_handle(next)));
}

/// The corner opposite to the half-edge of the triangle beside it, if there is one.
HalfEdgeMesh::VertexHandle HalfEdgeMesh::apex(HalfedgeHandle edge) const {
  return is_boundary(edge) ? VertexHandle() : to_vertex_handle(next_halfedge_handle(edge));
}

// ---- the order ----

Collapser::Collapser(HalfEdgeMesh& mesh) : BaseDecimaterT(mesh) {
  add(quadrics_);
  module(quadrics_).unset_max_err();  // it ranks collapses and forbids none
}

/// The least harmful edge that may collapse, its start into its end; of equal ones the first.
Collapser::Edge Collapser::best_edge(Vertex vertex, float& harm) {
  choices_.clear();
  if (mesh().status(vertex).locked()) return Edge();
  for (const Edge edge : mesh().voh_range(vertex)) {
    const float harm_of_edge = module(quadrics_).collapse_priority({mesh(), edge});
    if (harm_of_edge >= 0 && harm_of_edge < std::numeric_limits<float>::max()) {
      choices_.push_back({harm_of_edge, edge});
    }
  }
  for (auto left = choices_.begin(); left != choices_.end(); ++left) {
    // Swapping the least one to the front would change the order of equal ones.
    const auto least = std::ranges::min_element(left, choices_.end(), {}, &Choice::harm);
    std::rotate(left, least, least + 1);
    const CollapseInfo collapse(mesh(), left->edge);
    if (is_collapse_legal(collapse) && collapse_priority(collapse) >= 0) {
      harm = left->harm;
      return left->edge;
    }
  }
  return Edge();
}

/// Puts the vertex to its place on the heap, or takes it off.
void Collapser::rank(Vertex vertex, Heap& heap) {
  Choice& best = best_[number(vertex)];
  float harm = -1;
  const Edge edge = best_edge(vertex, harm);
  const bool was_stored = heap.is_stored(vertex);
  if (edge.is_valid()) {
    best = {harm, edge};
    was_stored ? heap.update(vertex) : heap.insert(vertex);
  } else {
    if (was_stored) heap.remove(vertex);
    best = {-1, edge};
  }
}

void Collapser::collapse_to(std::size_t triangles, const std::stop_token& stop) {
  constexpr std::size_t kPolled = 1024;
  initialize();
  best_.assign(mesh().n_vertices(), {-1, Edge()});
  places_.assign(mesh().n_vertices(), -1);
  Heap heap(Order{&best_, &places_});
  heap.reserve(mesh().n_vertices());
  std::size_t left = mesh().n_faces(), done = 0;
  if (left <= triangles) return;
  for (const Vertex vertex : mesh().vertices()) {
    if (++done % kPolled == 0) throw_if_stopped(stop);
    rank(vertex, heap);
  }
  std::vector<Vertex> around;
  while (!heap.empty() && left > triangles) {
    if (++done % kPolled == 0) throw_if_stopped(stop);
    const Edge edge = best_[number(heap.front())].edge;
    heap.pop_front();
    CollapseInfo collapse(mesh(), edge);
    if (!is_collapse_legal(collapse)) continue;
    around.clear();
    for (const Vertex v : mesh().vv_range(collapse.v0)) around.push_back(v);
    left -= mesh().is_boundary(collapse.v0v1) || mesh().is_boundary(collapse.v1v0) ? 1 : 2;
    preprocess_collapse(collapse);
    mesh().collapse(edge);
    for (const auto face : mesh().vf_range(collapse.v1)) {
      mesh().set_normal(face, mesh().calc_face_normal(face));
    }
    postprocess_collapse(collapse);
    for (const Vertex v : around) rank(v, heap);
  }
}

}  // namespace qjulia::shape
