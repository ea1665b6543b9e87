#include "explore/page_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "base/base64.hpp"
#include "base/deflate.hpp"
#include "explore/scene_table.hpp"
#include "qjulia/base/material_range.hpp"
#include "qjulia/map/distance_grid.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/picture/materials.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia::explore {
namespace {

using nlohmann::json;

/// As shaders have it: the shortest text that means the same in 32 bits, and nothing infinite.
double shader_number(double value) {
  return std::stod(fmt::format("{}", static_cast<float>(std::clamp(value, -1e30, 1e30))));
}

/// What was measured is known to fewer digits.
double measured_number(double value) {
  return std::stod(fmt::format("{:.5g}", std::clamp(value, -1e30, 1e30)));
}

json list_of(const Eigen::Vector3d& v) {
  return {shader_number(v.x()), shader_number(v.y()), shader_number(v.z())};
}

json list_of(const Quaternion& q) {
  return {shader_number(q.x), shader_number(q.y), shader_number(q.z), shader_number(q.w)};
}

json list_of(const std::array<int, 3>& cells) { return json(cells); }

/// Little-endian, as browsers' typed arrays are on all machines that have them.
template <class Number>
std::string packed(std::span<const Number> values) {
  return base::base64(base::deflated(
      {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Number)}));
}

/// A leaf of a kind as a uniform.
template <class Leaf>
json uniform_of(const Leaf& leaf) {
  if constexpr (std::is_enum_v<Leaf>) {
    return static_cast<int>(leaf);
  } else if constexpr (std::is_integral_v<Leaf>) {
    return leaf;
  } else if constexpr (std::is_same_v<Leaf, Quaternion>) {
    return list_of(leaf);
  } else {
    return shader_number(leaf);
  }
}
json uniform_of(const Eigen::Vector3d& v) { return list_of(v); }
json uniform_of(const std::shared_ptr<const DistanceGrid>& grid) {
  return list_of(grid->data().cells);
}

/// What KIND_modulus.glsl and KIND_versor.glsl declare: uniforms that are called as in map files,
/// ROLE_MEMBER for a quaternion ("modulus_c") and MEMBER_LEAF in an object ("noise_scale"). That of
/// a grid is its number of cells.
template <class Kind>
void add_uniforms(const std::string& role, const Kind& kind, json& uniforms) {
  Kind::members(kind, [&]<class Member>(const std::string& name, const Member& member) {
    if constexpr (std::is_same_v<Member, Quaternion>) {
      uniforms[role + "_" + name] = list_of(member);
    } else {
      Member::leaves(member, [&](const std::string& leaf_name, const auto& leaf) {
        uniforms[name + "_" + (leaf_name.empty() ? "cells" : leaf_name)] = uniform_of(leaf);
      });
    }
  });
}

void add_portals(const std::vector<Portal>& portals, json& uniforms) {
  uniforms["portal_count"] = portals.size();
  for (const Portal& portal : portals) {
    json ball = list_of(portal.center), destination = list_of(portal.destination);
    ball.push_back(shader_number(portal.radius));
    destination.push_back(side_of(portal.mask));
    uniforms["portal_balls"].push_back(ball);
    uniforms["portal_destinations"].push_back(destination);
    const Eigen::Matrix3d matrix = portal.scale * portal.rotation.matrix();
    for (int column = 0; column < 3; ++column) {
      uniforms["portal_matrices"].push_back(list_of(Eigen::Vector3d(matrix.col(column))));
    }
    uniforms["portal_scales"].push_back(shader_number(portal.scale));
  }
}

json uniforms_of(const Map& map) {
  const auto& [dynamics, layers, frame] = std::tie(map.dynamics, map.layers, map.frame);
  // A grid is steep by its shell, and factors beside it stay.
  const bool has_grid = std::holds_alternative<DistanceModulus>(dynamics.modulus);
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  const Box box = frame.box ? frame.shape_to_map.to_map(*frame.box) : Box{none, none};
  json uniforms = {
      {"map_log_scale", shader_number(dynamics.log_scale)},
      {"map_file_level", shader_number(dynamics.surface_level)},
      {"map_own_detail", shader_number(frame.detail.value_or(1))},
      {"map_inradius", shader_number(frame.inradius.value_or(0) * frame.shape_to_map.scale)},
      {"factors_follow_detail", has_grid ? 0 : 1},
      {"shape_scale", shader_number(frame.shape_to_map.scale)},
      {"shape_translation", list_of(frame.shape_to_map.translation)},
      {"box_low", list_of(box.low)},
      {"box_high", list_of(box.high)}};
  std::visit([&](const auto& kind) { add_uniforms("modulus", kind, uniforms); }, dynamics.modulus);
  std::visit([&](const auto& kind) { add_uniforms("versor", kind, uniforms); }, dynamics.versor);
  if (const auto& paint = layers.paint) {
    uniforms["paint_origin"] = list_of(paint->origin);
    uniforms["paint_step"] = shader_number(paint->step);
    uniforms["paint_cells"] = list_of(paint->cells);
  }
  if (!layers.portals.empty()) add_portals(layers.portals, uniforms);
  return uniforms;
}

/// Exponents, four a group, then centres; those that fill up the last group have exponent 0.
std::vector<float> factor_values(const std::vector<Factor>& factors) {
  const std::size_t places = (factors.size() + 3) / 4 * 4;
  std::vector<float> values(5 * places);
  for (std::size_t k = 0; k < factors.size(); ++k) {
    values[k] = static_cast<float>(factors[k].exponent);
    const auto center = coordinates(factors[k].center);
    for (std::size_t axis = 0; axis < 4; ++axis) {
      values[places + 4 * k + axis] = static_cast<float>(center[axis]);
    }
  }
  return values;
}

json rounded(const std::vector<double>& values) {
  json all = json::array();
  for (const double value : values) all.push_back(measured_number(value));
  return all;
}

/// A grid's box, and numbers of cells while a slice moves and once it rests.
json grid_json(const Box& box) {
  constexpr int kCoarseCells = 40, kFineCells = 64;  // along the longest side
  json made = {{"grid_low", rounded({box.low.begin(), box.low.end()})},
               {"grid_high", rounded({box.high.begin(), box.high.end()})}};
  for (const auto& [name, cells] : {std::pair{"coarse", kCoarseCells}, {"fine", kFineCells}}) {
    const double cell = box.size().maxCoeff() / cells;
    for (const double side : box.size()) {
      made[name].push_back(std::max(1, static_cast<int>(std::ceil(side / cell))));
    }
  }
  return made;
}

json table_json(const SceneTable& table) {
  json made = {{"drifts", rounded(table.drifts)},
               {"levels", rounded(table.levels)},
               {"slices", rounded(table.slices.nodes)}};
  for (const KnobNodes& knob : table.knobs) {
    made["knobs"].push_back({{"knob", knob.knob}, {"nodes", rounded(knob.nodes)}});
  }
  std::vector<std::uint8_t> rows;
  for (const SceneTable::Entry& entry : table.entries) {
    rows.insert(rows.end(),
                {entry.inner, entry.outer, entry.band, entry.slope, entry.single_slope});
  }
  made["entries"] = packed<std::uint8_t>(rows);
  for (const double inner : table.inner) made["inner"].push_back(measured_number(std::log(inner)));
  for (const OuterRadii& radii : table.outer) {
    made["outer"].push_back(
        {measured_number(std::log(radii.outer)), measured_number(std::log(radii.escape))});
  }
  for (const std::vector<Box>& of_cell : table.boxes) {
    json boxes = json::array();
    for (const Box& box : of_cell) boxes.push_back(grid_json(box));
    made["grids"].push_back(boxes);
  }
  for (const std::vector<double>& of_cell : table.slopes)
    made["slopes"].push_back(rounded(of_cell));
  return made;
}

/// Equal parts of the palette.
constexpr std::size_t kPaletteParts = 8;
using PaletteValues = std::vector<double>;  ///< where they begin and end

/// As `render` spreads the palette, over the set as its file has it, seen from all around.
PaletteValues palette_values(const Device& device, const Map& map, Material material,
                             int iterations, const std::stop_token& stop) {
  constexpr int kAround = 6;
  constexpr double kTilt = 20;
  PictureOptions options;
  options.keep_loose = true;
  options.material = material;
  options.iterations = iterations;
  options.width = 160, options.height = 120;
  options.camera.up = map.frame.up.value_or(kDefaultUp);
  Studio studio = Studio::of_drafts(device, map, options, stop);
  std::vector<Camera> cameras(kAround, options.camera);
  for (int i = 0; i < kAround; ++i) {
    cameras[static_cast<std::size_t>(i)].azimuth += 360.0 * i / kAround;
    cameras[static_cast<std::size_t>(i)].elevation = i % 2 == 0 ? -kTilt : kTilt;
  }
  cameras = studio.aimed(cameras);
  const MaterialRange range = range_over(studio.shown(cameras), material);
  PaletteValues values = range.values();
  if (values.size() == kPaletteParts + 1) return values;
  values.clear();
  for (std::size_t i = 0; i <= kPaletteParts; ++i) {
    values.push_back(std::lerp(range.low, range.high, static_cast<double>(i) / kPaletteParts));
  }
  return values;
}

/// For each material and each number of iterations, from 1 on. Between the numbers that are
/// measured, values are linear.
json ranges_json(const Device& device, const Map& map, const std::stop_token& stop) {
  const std::vector<int> many{1, 2, 4, 6, 10, 16}, few{1, 6, 16};
  json all;
  for (const MaterialFacts& facts : materials()) {
    const Material material = facts.material;
    if (material == Material::clay) continue;
    if (facts.needs_factors && map.dynamics.factors.empty()) continue;
    const std::vector<int>& nodes = facts.follows_iterations ? many : few;
    json& of_material = all[to_string(material)];
    PaletteValues before;
    int last = 0;
    for (const int n : nodes) {
      const PaletteValues values = palette_values(device, map, material, n, stop);
      if (before.empty()) before = values;
      for (int i = last + 1; i <= n; ++i) {
        PaletteValues row;
        for (std::size_t k = 0; k < values.size(); ++k) {
          row.push_back(std::lerp(before[k], values[k], double(i - last) / (n - last)));
        }
        of_material.push_back(rounded(row));
      }
      before = values;
      last = n;
    }
  }
  return all;
}

/// The numbers by which trait.glsl knows materials.
json traits_json() {
  json all;
  for (const MaterialFacts& facts : materials()) all[facts.word] = facts.trait;
  return all;
}

}  // namespace

std::map<std::string, std::string> shader_files(const Map& map) {
  const auto file = [](const auto& kinds, const char* end) {
    return std::visit([&](const auto& kind) { return kind.kName + std::string(end); }, kinds);
  };
  return {{"QJ_MODULUS", file(map.dynamics.modulus, "_modulus.glsl")},
          {"QJ_VERSOR", file(map.dynamics.versor, "_versor.glsl")},
          {"QJ_PAINT", map.layers.paint ? "painted.glsl" : "unpainted.glsl"},
          {"QJ_PORTALS", map.layers.portals.empty() ? "without_portals.glsl" : "portals.glsl"}};
}

PageScene page_scene(const Device& device, const Map& map, const std::stop_token& stop) {
  const SceneTable table = scene_table(device, map, stop);
  json made = {{"files", shader_files(map)},
               {"portals", map.layers.portals.size()},
               {"factors", packed<float>(factor_values(map.dynamics.factors))},
               {"groups", (map.dynamics.factors.size() + 3) / 4},
               {"uniforms", uniforms_of(map)},
               {"phase", list_of(map.dynamics.phase)},
               {"table", table_json(table)},
               {"traits", traits_json()},
               {"ranges", ranges_json(device, map, stop)}};
  return {made.dump(), table.drifts.back()};
}

}  // namespace qjulia::explore
