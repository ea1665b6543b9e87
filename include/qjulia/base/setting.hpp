#pragma once
/// How a value that a user may set is described. Each options struct has a table of settings, and
/// from these tables come options of commands, JSON, queries of pages, the keys of checkpoints,
/// keywords of Python, sweeps and the reference.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "qjulia/base/box.hpp"
#include "qjulia/base/cut.hpp"
#include "qjulia/base/detail_choice.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/lamp.hpp"
#include "qjulia/base/material_range.hpp"
#include "qjulia/base/quaternion.hpp"
#include "qjulia/base/rotation.hpp"
#include "qjulia/base/up_axis.hpp"

namespace qjulia {

struct Palette;

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
  bool needs_server = false;         ///< browsers do not draw it
};

/// A value that can be given, in the words of a command line. Each setting has one: the tests give
/// it at every door.
class Example {
 public:
  Example(const char* words) : words_(words) {}  // NOLINT(*-explicit-*): for tables
  const std::string& words() const { return words_; }

 private:
  std::string words_;
};

/// The value of an enumeration, which users call by a word.
class WordPlace {
 public:
  /// @param value its enumerators count from 0, in the order of `Setting::words`.
  template <class Enumeration>
  requires std::is_enum_v<Enumeration>
  explicit WordPlace(Enumeration& value)
      : place_(&value),
        get_([](const void* place) {
          return static_cast<std::size_t>(*static_cast<const Enumeration*>(place));
        }),
        set_([](void* place, std::size_t index) {
          *static_cast<Enumeration*>(place) = static_cast<Enumeration>(index);
        }) {}

  std::size_t index() const { return get_(place_); }
  void set(std::size_t index) const { set_(place_, index); }

 private:
  void* place_;
  std::size_t (*get_)(const void*);
  void (*set_)(void*, std::size_t);
};

/// A picture's size in pixels, which users give as WIDTHxHEIGHT.
struct SizePlace {
  int* width;
  int* height;

  std::string text() const;
  /// @throws InputError for what is no WIDTHxHEIGHT of whole numbers above 0
  void read(std::string_view text) const;
};

/// Where a setting's value stands in its struct. Whatever reads or shows values of all settings is
/// a visitor of this. An optional value may be left out.
using ValuePlace =
    std::variant<bool*, int*, std::uint64_t*, double*, std::string*, WordPlace, SizePlace,
                 DetailChoice*, Quaternion*, Palette*, Background*, std::vector<Lamp>*,
                 std::vector<Cut>*, std::optional<MaterialRange>*, std::optional<LightColor>*,
                 std::optional<int>*, std::optional<std::uint64_t>*, std::optional<double>*,
                 std::optional<Eigen::Vector3d>*, std::optional<Quaternion>*,
                 std::optional<Rotation>*, std::optional<Box>*, std::optional<UpAxis>*>;

/// What all settings have.
struct Setting {
  std::string
      name;  ///< that of the struct's member, such as "order_seed"; "order-seed" is the option
  std::string values{};  ///< what to give, such as "X Y Z"; empty: one of `words`
  std::string unit{};    ///< empty: it has none, or `help` says it
  /// What is accepted; `kAboveZero` for numbers above 0.
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool may_be_infinite = false;  ///< infinity is accepted where the range allows it; NaN never is
  std::vector<std::string> words{};  ///< an enumeration's, in the order of its values
  std::string automatic{};  ///< the word for an optional value that is left out, such as "auto"
  std::string left_out{};   ///< what is used then, after "Default: "
  Example example;
  /// A sentence, without its full stop. Names of other settings stand in backquotes.
  std::string help;
  std::string more{};  ///< a paragraph for those who want to know what to expect; may be empty
  Interpolation interpolation = Interpolation::linear;
  std::string group{};  ///< where pages show its controls; empty: pages do not offer it
  std::vector<Control> controls{};

  static constexpr double kAboveZero = std::numeric_limits<double>::min();

  /// "order-seed".
  std::string option() const;
  /// `values`, or the words with bars between them.
  std::string values_text() const;
  /// What is accepted, in words: "1 to 100", "more than 0".
  std::string range_text() const;
  /// @throws InputError for a value out of range, saying which to give.
  void expect_in_range(double value) const;
  /// The place of a word in `words`. @throws InputError that lists them.
  std::size_t index_of(std::string_view word) const;
};

/// A setting of a struct of options.
template <class Options>
struct SettingOf : Setting {
  ValuePlace (*place)(Options&);
};

/// The setting of this name. @param what the settings are of, such as "pictures".
/// @throws InputError where there is none.
template <class Table>
const auto& setting_named(const Table& table, std::string_view name, const char* what) {
  for (const auto& setting : table) {
    if (setting.name == name) return setting;
  }
  throw InputError("there is no setting '" + std::string(name) + "' of " + what);
}

/// The option that gives the setting another value than `place` has: "no-ground" where the setting
/// holds unless it is turned off, else `Setting::option`.
std::string option_of(const Setting& setting, const ValuePlace& place);

/// @throws OptionError naming the setting if a number is out of its range; numbers that are left
/// out are in range.
void expect_in_range(const Setting& setting, const ValuePlace& place);

template <class Table, class Options>
void expect_in_ranges(const Table& table, Options options) {
  for (const auto& setting : table) expect_in_range(setting, setting.place(options));
}

}  // namespace qjulia
