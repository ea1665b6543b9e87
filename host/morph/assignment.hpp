#pragma once
/// Pairs of least cost.

#include <cstddef>
#include <functional>
#include <stop_token>
#include <vector>

namespace qjulia::morph {

/// Row i of a square table of finite costs is paired with column result[i], so that the sum of
/// costs is the least: shortest augmenting paths, count³ steps (Jonker and Volgenant 1987). Each
/// cost is asked for once. @throws Interrupted.
std::vector<std::size_t> least_cost_pairs(
    std::size_t count, const std::function<double(std::size_t row, std::size_t column)>& cost,
    const std::stop_token& stop = {});

}  // namespace qjulia::morph
