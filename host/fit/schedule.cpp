#include "fit/schedule.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>

#include "base/input_file.hpp"
#include "base/toml.hpp"
#include "fit/embedded_schedules.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia::fitting {
namespace {

constexpr double kMostSamples = 1e9;
constexpr double kLargestGrid = 512;
constexpr double kMostSteps = 1e6;
constexpr double kOffSliceWeight = 0.5;

bool is_file(const std::string& name) { return std::filesystem::path(name).extension() == ".toml"; }

std::string path_of(std::string_view name) { return fmt::format("schedules/{}.toml", name); }

/// Reads one table; every key must be asked for before `finish`.
class Table {
 public:
  Table(const toml::table& table, const std::string& file) : table_(table), file_(file) {}

  void number(const char* key, double& value, double low, double high) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    const auto given = node->value<double>();
    if (!given || !(*given >= low && *given <= high)) {
      fail(*node, fmt::format("'{}' must be a number between {} and {}", key, low, high));
    }
    value = *given;
  }

  void number(const char* key, int& value, double low, double high) {
    double given = value;
    number(key, given, low, high);
    if (given != std::floor(given)) fail(*find(key), fmt::format("'{}' must be whole", key));
    value = static_cast<int>(given);
  }

  template <class Value>
  void choice(const char* key, Value& value, const std::map<std::string, Value>& choices) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    const auto found = choices.find(node->value_or<std::string>(""));
    if (found == choices.end()) {
      std::string names;
      for (const auto& [name, unused] : choices) names += fmt::format(" \"{}\"", name);
      fail(*node, fmt::format("'{}' must be one of{}", key, names));
    }
    value = found->second;
  }

  void text(const char* key, std::string& value) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    const auto given = node->value<std::string>();
    if (!given) fail(*node, fmt::format("'{}' must be text", key));
    value = *given;
  }

  const toml::node* find(const char* key) {
    known_ += fmt::format("{}{}", known_.empty() ? "" : ", ", key);
    const toml::node* node = table_.get(key);
    if (node != nullptr) ++found_;
    return node;
  }

  /// @throws InputError for a key that was not asked for.
  void finish() const {
    if (found_ >= table_.size()) return;
    for (auto&& [key, node] : table_) {
      if ((", " + known_ + ",").find(fmt::format(", {},", key.str())) == std::string::npos) {
        fail(node, fmt::format("'{}' is not known; there are: {}", key.str(), known_));
      }
    }
  }

  [[noreturn]] void fail(const toml::node& node, const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", file_, node.source().begin.line, what));
  }

 private:
  const toml::table& table_;
  const std::string& file_;
  std::string known_;
  std::size_t found_ = 0;
};

Level read_level(const toml::table& toml, const std::string& file, double after) {
  Level level;
  Table table(toml, file);
  table.text("name", level.name);
  table.number("until", level.until, 0, 1);
  table.choice<Points>("points", level.points,
                       {{"surface", Points::surface}, {"grid", Points::grid}});
  const bool on_grid = level.points == Points::grid;
  if (on_grid) level.samples = 50;
  table.number("iterations", level.iterations, 1, kMostIterations);
  const bool iterated = level.iterations > 1;
  table.number("samples", level.samples, on_grid ? 4 : 100, on_grid ? kLargestGrid : kMostSamples);
  if (on_grid || iterated) level.loss = Loss::tanh;
  table.choice<Loss>("loss", level.loss, kLosses);
  table.number("alpha", level.alpha, 1e-3, 1e6);
  table.number("band", level.band, 1e-6, 2);
  table.number("band_weight", level.band_weight, 0, 1e6);
  if (!on_grid && level.loss == Loss::distance) level.off_slice_weight = kOffSliceWeight;
  table.number("off_slice_weight", level.off_slice_weight, 0, 1e6);
  table.number("reweight", level.reweight, 0, 100);
  table.choice<Space>("unknowns", level.space,
                      {{"scalars", Space::scalars},
                       {"clusters", Space::clusters},
                       {"exponents", Space::exponents},
                       {"all", Space::all}});
  table.number("clusters", level.clusters, 2, 20'000);
  table.number("steps", level.steps, 1, kMostSteps);
  table.number("relocate", level.relocated, 0, 20'000);
  table.finish();
  if (level.until <= after) {
    table.fail(toml,
               "'until' must rise from level to level; it is the share of the budget at "
               "which the level ends");
  }
  if (iterated && level.loss != Loss::tanh) {
    table.fail(toml, "'iterations' above 1 need loss \"tanh\"");
  }
  if (level.relocated > 0 && level.loss != Loss::distance) {
    table.fail(toml, "'relocate' needs loss \"distance\"");
  }
  if (level.off_slice_weight > 0 && (on_grid || level.loss != Loss::distance)) {
    table.fail(toml, "'off_slice_weight' needs points \"surface\" and loss \"distance\"");
  }
  return level;
}

Schedule read_schedule(const std::string& text, const std::string& file) {
  const toml::table root = base::parse_toml(text, file);
  Schedule schedule;
  Table table(root, file);
  table.number("evaluations", schedule.evaluations, 1, 1e9);
  table.number("damping", schedule.damping, 1e-9, 1);
  const toml::node* levels = table.find("level");
  const toml::node* automatic = table.find("auto");
  table.finish();
  if (levels == nullptr || !levels->is_array_of_tables() || schedule.evaluations == 0) {
    throw InputError(
        fmt::format("{}: a schedule needs 'evaluations' and at least one [[level]]", file));
  }
  if (automatic != nullptr) {
    if (!automatic->is_table()) table.fail(*automatic, "'auto' must be a table");
    Table auto_table(*automatic->as_table(), file);
    auto_table.number("factors", schedule.automatic.factors, 8, 20'000);
    auto_table.number("evaluations", schedule.automatic.evaluations, 0, 1e9);
    auto_table.number("stages", schedule.automatic.stages, 0, 1e6);
    auto_table.finish();
  }
  double after = 0;
  int iterations = 1;
  for (const toml::node& level : *levels->as_array()) {
    schedule.levels.push_back(read_level(*level.as_table(), file, after));
    const Level& last = schedule.levels.back();
    after = last.until;
    if (last.iterations < iterations) {
      throw InputError(fmt::format("{}: 'iterations' may not fall from level to level", file));
    }
    iterations = last.iterations;
  }
  if (after != 1) throw InputError(fmt::format("{}: the last level must have until = 1", file));
  return schedule;
}

}  // namespace

Schedule with_polish(Schedule schedule, double detail) {
  constexpr double kBefore = 0.6;
  constexpr double kDiagonal = 4;  // boxes whose longest side is 3 have 3 to 5.2
  schedule.evaluations = static_cast<int>(schedule.evaluations / kBefore);
  schedule.automatic.evaluations = static_cast<int>(schedule.automatic.evaluations / kBefore);
  schedule.automatic.stages = static_cast<int>(schedule.automatic.stages / kBefore);
  for (Level& level : schedule.levels) level.until *= kBefore;
  schedule.levels.push_back({.name = "polish",
                             .iterations = 2,
                             .loss = Loss::tanh,
                             .alpha = 1,
                             .band = detail * kDiagonal});
  return schedule;
}

Schedule find_schedule(const std::string& name) { return read_schedule(schedule_text(name), name); }

Schedule schedule_of(const FitOptions& options) {
  return options.schedule_text.empty() ? find_schedule(options.schedule)
                                       : read_schedule(options.schedule_text, "schedule_text");
}

std::string text_of_schedule(const FitOptions& options) {
  return options.schedule_text.empty() ? schedule_text(options.schedule) : options.schedule_text;
}

}  // namespace qjulia::fitting

std::string qjulia::schedule_text(const std::string& name) {
  if (!fitting::is_file(name)) {
    const auto& all = fitting::embedded_schedules();
    const auto found = all.find(fitting::path_of(name));
    if (found != all.end()) return std::string(found->second);
    std::string names;
    for (const auto& [path, text] : all) {
      names += ' ' + std::filesystem::path(path).stem().string();
    }
    throw OptionError("schedule", fmt::format("there is none named '{}'; choose from:{}, or give "
                                              "a .toml file",
                                              name, names));
  }
  if (std::filesystem::is_fifo(name)) {
    throw OptionError("schedule", fmt::format("'{}' is a pipe; give a regular file: a schedule is "
                                              "read more than once",
                                              name));
  }
  constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 20;
  return base::read_text_file(name, "schedule", kLargestFile);
}
