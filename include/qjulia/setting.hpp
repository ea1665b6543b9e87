#pragma once
/// How a number, or a few, that a user may set is described: once, for command lines, requests,
/// pages and the reference.

#include <limits>
#include <string>
#include <vector>

namespace qjulia {

/// How a setting goes from one value to another, as in films.
enum class Interpolation {
  none,         ///< it jumps
  linear,       ///< equal steps
  logarithmic,  ///< equal ratios
  rotation,     ///< along the shortest turn
};
const char* to_string(Interpolation interpolation);

/// What sets a setting, or a part of it, on a page: a slider with a number, or a menu.
struct Control {
  std::string name;   ///< in a page's address
  std::string label;  ///< beside it
  std::string help;   ///< a tooltip
  double least = 0, most = 1;
  double step = 0.01;                ///< the slider's
  bool is_logarithmic = false;       ///< equal ways multiply the value by the same
  bool is_whole = false;             ///< it takes whole numbers alone
  std::vector<std::string> words{};  ///< a menu's entries; empty: it is a slider
};

/// What all settings have.
struct Setting {
  std::string
      name;  ///< that of the struct's member, such as "order_seed"; "order-seed" is the option
  std::string values;  ///< what to give, such as "X Y Z"
  std::string unit;    ///< empty: it has none, or `help` says it
  /// What commands and pages take.
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  std::string help;  ///< a sentence, without its full stop
  std::string more;  ///< a paragraph for those who want to know what to expect; may be empty
  Interpolation interpolation = Interpolation::linear;
  std::string group{};  ///< where pages show its controls; empty: pages do not offer it
  std::vector<Control> controls{};

  /// "order-seed".
  std::string option() const;
  /// What commands and pages take, in words: "1 to 100", "more than 0".
  std::string range_text() const;
  /// @throws InputError for a value out of range, saying which to give.
  void expect_in_range(double value) const;
};

}  // namespace qjulia
