#pragma once

namespace qjulia::exact {

/// Cells of a distance grid along its longest side.
constexpr int kFewestGridCells = 32, kMostGridCells = 384;

}  // namespace qjulia::exact
