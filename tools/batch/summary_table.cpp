#include "batch/summary_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>

namespace qjulia::batch {
namespace {

using nlohmann::json;

constexpr std::array kComparison = {
    "iou",    "roughness",       "mean_distance", "distance_95", "hausdorff_distance",
    "energy", "slope_variation", "limbs",         "limbs_kept"};

std::string cell(const json& value) {
  if (value.is_null()) return {};
  return value.is_string() ? value.get<std::string>()
                           : value.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string cell(const json& object, const std::string& name) {
  const auto found = object.find(name);
  return found == object.end() ? std::string() : cell(*found);
}

/// Every name that any entry has in the object, but `left_out`, sorted.
std::set<std::string> names(const std::vector<EntryStatus>& entries, json EntryStatus::*object,
                            const std::set<std::string>& left_out) {
  std::set<std::string> all;
  for (const EntryStatus& entry : entries) {
    for (const auto& [name, value] : (entry.*object).items()) {
      if (!left_out.contains(name)) all.insert(name);
    }
  }
  return all;
}

std::string fit_column(const std::string& figure) {
  return figure.starts_with("fit_") ? figure : "fit_" + figure;
}

std::string map_file(const EntryStatus& entry) {
  const auto found = std::ranges::find(entry.files, entry.name + ".qjulia.json");
  return entry.state == EntryState::done && found != entry.files.end() ? *found : std::string();
}

std::string warning_count(const EntryStatus& entry) {
  const auto found = entry.figures.find("warnings");
  return found == entry.figures.end() ? std::string() : fmt::format("{}", found->size());
}

/// What is known at each n: the comparisons made, or only the n wanted.
std::vector<json> comparisons(const EntryStatus& entry) {
  std::vector<json> all;
  if (const auto made = entry.figures.find("comparisons"); made != entry.figures.end()) {
    for (const json& one : *made) all.push_back(one);
  } else if (const auto n = entry.settings.find("compare"); n != entry.settings.end()) {
    for (const json& one : *n) all.push_back({{"iterations", one}});
  }
  if (all.empty()) all.push_back(json::object());
  return all;
}

}  // namespace

SummaryTable summary_table(const std::vector<EntryStatus>& entries) {
  const auto settings = names(entries, &EntryStatus::settings, {"compare"});
  const auto figures = names(entries, &EntryStatus::figures, {"comparisons", "warnings"});
  SummaryTable table{{"name", "n", "mesh", "map", "state"}, {}};
  auto& columns = table.columns;
  columns.insert(columns.end(), settings.begin(), settings.end());
  columns.insert(columns.end(), kComparison.begin(), kComparison.end());
  for (const std::string& figure : figures) columns.push_back(fit_column(figure));
  for (const char* name : {"seconds", "seconds_all", "memory_bytes", "joules", "warnings", "device",
                           "host", "started", "error"}) {
    columns.emplace_back(name);
  }
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const EntryStatus& e = entries[i];
    for (const json& comparison : comparisons(e)) {
      SummaryRow row{
          i, {e.name, cell(comparison, "iterations"), e.mesh, map_file(e), to_string(e.state)}};
      auto& cells = row.cells;
      for (const std::string& name : settings) cells.push_back(cell(e.settings, name));
      for (const char* name : kComparison) cells.push_back(cell(comparison, name));
      for (const std::string& name : figures) cells.push_back(cell(e.figures, name));
      cells.push_back(fmt::format("{:.3f}", e.seconds));
      cells.push_back(fmt::format("{:.3f}", e.earlier_seconds + e.seconds));
      cells.push_back(e.memory_bytes > 0 ? fmt::format("{}", e.memory_bytes) : std::string());
      cells.push_back(e.joules ? fmt::format("{:.1f}", *e.joules) : std::string());
      cells.insert(cells.end(), {warning_count(e), e.device, e.host, e.started, e.error});
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

}  // namespace qjulia::batch
