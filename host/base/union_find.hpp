#pragma once
/// Disjoint sets of numbered elements, such as the vertices of a mesh's components.

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace qjulia::base {

/// Union-find with path halving. Which element represents a set depends on the order of the unions
/// alone.
class UnionFind {
 public:
  explicit UnionFind(std::size_t elements = 0) : parent_(elements) {
    std::iota(parent_.begin(), parent_.end(), 0U);
  }

  /// Adds an element in a set of its own, numbered after all others.
  void add() { parent_.push_back(static_cast<std::uint32_t>(parent_.size())); }

  /// The element that represents the set of `element`.
  std::uint32_t root(std::uint32_t element) {
    while (parent_[element] != element) {
      element = parent_[element] = parent_[parent_[element]];
    }
    return element;
  }
  void unite(std::uint32_t a, std::uint32_t b) { parent_[root(a)] = root(b); }

  std::size_t size() const { return parent_.size(); }
  std::size_t sets() {
    std::size_t count = 0;
    for (std::uint32_t element = 0; element < parent_.size(); ++element) {
      if (root(element) == element) ++count;
    }
    return count;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace qjulia::base
