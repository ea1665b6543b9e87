#include "morph/assignment.hpp"

#include <limits>

#include "qjulia/base/progress.hpp"

namespace qjulia::morph {
namespace {

constexpr std::size_t kUnpaired = std::numeric_limits<std::size_t>::max();

}  // namespace

std::vector<std::size_t> least_cost_pairs(
    std::size_t count, const std::function<double(std::size_t row, std::size_t column)>& cost,
    const std::stop_token& stop) {
  std::vector<double> costs(count * count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) costs[i * count + j] = cost(i, j);
  }
  std::vector<double> row_price(count), column_price(count);
  std::vector<std::size_t> row_of(count, kUnpaired), column_of(count, kUnpaired);
  for (std::size_t start = 0; start < count; ++start) {
    throw_if_stopped(stop);
    // Dijkstra over reduced costs, from the row to the nearest column that is free.
    std::vector<double> way(count, std::numeric_limits<double>::infinity());
    std::vector<std::size_t> from(count, start);  // the row before each column
    std::vector<bool> settled(count);
    std::vector<std::size_t> order;  // settled columns
    std::size_t row = start;
    std::size_t column = kUnpaired;
    double length = 0;
    for (;;) {
      std::size_t nearest = kUnpaired;
      for (std::size_t j = 0; j < count; ++j) {
        if (settled[j]) continue;
        const double onward = length + costs[row * count + j] - row_price[row] - column_price[j];
        if (onward < way[j]) {
          way[j] = onward;
          from[j] = row;
        }
        if (nearest == kUnpaired || way[j] < way[nearest]) nearest = j;
      }
      column = nearest;
      length = way[column];
      if (row_of[column] == kUnpaired) break;
      settled[column] = true;
      order.push_back(column);
      row = row_of[column];
    }
    row_price[start] += length;
    for (const std::size_t j : order) {
      row_price[row_of[j]] += length - way[j];
      column_price[j] -= length - way[j];
    }
    for (;;) {
      row = from[column];
      row_of[column] = row;
      const std::size_t before = column_of[row];
      column_of[row] = column;
      if (row == start) break;
      column = before;
    }
  }
  return column_of;
}

}  // namespace qjulia::morph
