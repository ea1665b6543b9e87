#pragma once
/// Which parts of a mesh are kept.

#include <optional>
#include <span>
#include <vector>

#include "qjulia/base/cut.hpp"
#include "qjulia/base/setting.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/surface/figures.hpp"

namespace qjulia {

/// The first three exclude each other. Without them, loose pieces are left out.
struct Selection {
  bool keep_loose = false;  ///< keep all connected parts
  bool largest_component = false;
  std::optional<double> min_component{};  ///< least area of parts that are kept, over the largest's
  std::vector<Cut> cuts{};                ///< what lies beyond is cut away, which opens the mesh

  /// @throws InputError where two exclude each other, OptionError
  void validate() const;
  bool drops_loose() const { return !keep_loose && !largest_component && !min_component; }
};

std::span<const SettingOf<Selection>> selection_settings();

/// Leaves out the parts that are not wanted, and cuts nothing. @return the loose pieces that went.
/// @throws as `Selection::validate`, InputError for a mesh that is none
LoosePieces select_parts(TriangleMesh& mesh, const Selection& selection);

/// Cuts the mesh open. @param box as `place_of` takes it. @throws as `cut_away`, InputError where
/// nothing is left
TriangleMesh cut_open(TriangleMesh mesh, const Selection& selection, const std::optional<Box>& box);

}  // namespace qjulia
