#pragma once
/// What structs of options have in common that look at a map's set: which part of space they look
/// at, and how orbits are iterated there.

#include <vector>

#include "qjulia/base/setting.hpp"

namespace qjulia {

Setting iterations_setting();
Setting box_setting();
Setting escape_setting();
Setting precision_setting();

/// For a struct with the members `iterations`, `box`, `escape` and `precision`.
template <class Options>
std::vector<SettingOf<Options>> orbit_settings() {
  return {{iterations_setting(), [](Options& o) -> ValuePlace { return &o.iterations; }},
          {box_setting(), [](Options& o) -> ValuePlace { return &o.box; }},
          {escape_setting(), [](Options& o) -> ValuePlace { return &o.escape; }},
          {precision_setting(), [](Options& o) -> ValuePlace { return WordPlace(o.precision); }}};
}

}  // namespace qjulia
