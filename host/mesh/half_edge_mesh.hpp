#pragma once
/// OpenMesh's half-edge mesh in double precision, and the order in which its edges collapse.

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/BaseDecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <OpenMesh/Tools/Utils/HeapT.hh>
#include <cstddef>
#include <stop_token>
#include <vector>

namespace qjulia::shape {

struct DoubleTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};

/// A mesh with two functions of its own, which give the same answers as the library's. Those are
/// compiled with assertions that compare the names of types at each status, and took most of a
/// decimation.
class HalfEdgeMesh : public OpenMesh::TriMesh_ArrayKernelT<DoubleTraits> {
 public:
  /// Whether the edge can be collapsed into the half-edge's end so that the surface stays manifold.
  bool is_collapse_ok(HalfedgeHandle edge);
  HalfedgeHandle find_halfedge(VertexHandle from, VertexHandle to) const;

 private:
  bool is_ear(HalfedgeHandle edge) const;
  VertexHandle apex(HalfedgeHandle edge) const;

  std::vector<VertexHandle> neighbors_;  ///< scratch
};

/// Collapses edges in the same order as OpenMesh's own decimater: the least harmful first. It ranks
/// a vertex's edges by their harm before it asks whether they may collapse, which is dear, and so
/// asks once or twice a vertex instead of six times.
class Collapser : public OpenMesh::Decimater::BaseDecimaterT<HalfEdgeMesh> {
 public:
  /// The modules that are added to it forbid collapses; quadrics rank them.
  explicit Collapser(HalfEdgeMesh& mesh);

  /// Collapses edges until at most so many triangles are left, or no edge may collapse any more.
  /// @throws Interrupted, which leaves the mesh as far as it has come.
  void collapse_to(std::size_t triangles, const std::stop_token& stop);

 private:
  using Vertex = HalfEdgeMesh::VertexHandle;
  using Edge = HalfEdgeMesh::HalfedgeHandle;

  struct Choice {
    float harm;
    Edge edge;
  };
  /// What the heap compares, and where it notes places.
  struct Order {
    std::vector<Choice>* best;
    std::vector<int>* places;

    bool less(Vertex a, Vertex b) const { return harm(a) < harm(b); }
    bool greater(Vertex a, Vertex b) const { return harm(a) > harm(b); }
    int get_heap_position(Vertex v) const { return (*places)[number(v)]; }
    void set_heap_position(Vertex v, int place) { (*places)[number(v)] = place; }

   private:
    float harm(Vertex v) const { return (*best)[number(v)].harm; }
  };
  using Heap = OpenMesh::Utils::HeapT<Vertex, Order>;

  static std::size_t number(Vertex v) { return static_cast<std::size_t>(v.idx()); }
  Edge best_edge(Vertex vertex, float& harm);
  void rank(Vertex vertex, Heap& heap);

  OpenMesh::Decimater::ModQuadricT<HalfEdgeMesh>::Handle quadrics_;
  std::vector<Choice> best_;     ///< by vertex, for those on the heap
  std::vector<int> places_;      ///< by vertex: on the heap, or -1
  std::vector<Choice> choices_;  ///< scratch
};

}  // namespace qjulia::shape
