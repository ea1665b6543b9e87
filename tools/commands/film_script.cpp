#include "commands/film_script.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <sstream>
#include <utility>

#include "base/glob.hpp"
#include "base/text.hpp"
#include "base/toml.hpp"
#include "commands/film_key_table.hpp"
#include "describe/files.hpp"
#include "describe/moving_settings.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::tools {
namespace {

constexpr std::size_t kMostPictures = 100'000;
constexpr int kMostCopies = 1000;
/// What a dive moves, and what would move its portal.
constexpr std::array kMovedByDive{"look-at", "distance",  "azimuth", "frame",
                                  "rotate",  "translate", "scale"};

/// Not a setting of views: which of the film's maps is shown.
constexpr const char* kAlongMaps = "maps";

std::size_t line_of_node(const toml::node& node) { return node.source().begin.line; }

/// The numbers of a value: one, or an array of them.
std::vector<double> numbers_of(const toml::node& node) {
  std::vector<double> numbers;
  const auto add = [&](const toml::node& number) {
    const auto value = number.value<double>();
    if (!value) throw InputError("give a number, or an array of numbers");
    numbers.push_back(*value);
  };
  if (const auto* list = node.as_array()) {
    for (const toml::node& each : *list) add(each);
  } else {
    add(node);
  }
  return numbers;
}

/// The diagonal of what is filmed, shape units.
double size_of(const std::string& input) {
  if (is_mesh_file(input)) return read_mesh(input).box().diagonal();
  const Map map = read_map(input);
  constexpr double kUsualSize = 2;  // map units
  return map.frame.own_diagonal().value_or(kUsualSize / map.frame.shape_to_map.scale);
}

/// Reads a script, table by table.
class ScriptReader {
 public:
  explicit ScriptReader(const ScriptPlace& place)
      : file_(place.file), wanted_seconds_(place.seconds), made_(file_, place.made, problems_) {
    script_.place = place;
  }

  FilmScript read() {
    const toml::table root = base::parse_toml(script_text(file_, "script"), file_.string());
    for (auto&& [key, node] : root) {
      const std::string name(key.str());
      const bool is_known =
          (name == "film" || name == "options" || name == "loop" || name == "dive")
              ? node.is_table()
              : name == "key" && node.is_array_of_tables();
      if (is_known) continue;
      attempt([&, &where = node] {
        fail(where, fmt::format("'{}' is not known here; a script has [film], [options], [loop], "
                                "[dive] and any number of [[key]]",
                                name));
      });
    }
    attempt([&] { read_film(root); });
    if (!script_.keys.empty()) attempt([&] { read_key_file(script_.keys); });
    if (const auto* options = root["options"].as_table()) {
      attempt([&] { read_options(*options); });
    }
    if (const auto* list = root["key"].as_array()) {
      for (const toml::node& each : *list) {
        if (const auto* const table = each.as_table()) attempt([&] { read_key(*table); });
      }
    }
    make_tracks(root["loop"].as_table());
    if (const auto* dive = root["dive"].as_table()) attempt([&] { read_dive(*dive); });
    if (problems_.empty() && is_geodesic_ && script_.has_maps()) {
      attempt([&] { script_.width = size_of(script_.input); });
    }
    if (problems_.empty()) return std::move(script_);
    throw InputError(fmt::format("{}", fmt::join(problems_, "\n")));
  }

 private:
  /// Makes the call, and keeps its error so that all errors of a script are reported together.
  template <class Call>
  void attempt(const Call& call) {
    try {
      call();
    } catch (const InputError& error) {
      if (std::ranges::find(problems_, error.what()) == problems_.end()) {
        problems_.emplace_back(error.what());
      }
    }
  }

  std::string place_of(const toml::node& node) const {
    return fmt::format("{}:{}", file_.string(), line_of_node(node));
  }

  [[noreturn]] void fail(const toml::node& node, const std::string& what) const {
    throw InputError(fmt::format("{}: {}", place_of(node), what));
  }

  /// What `call` returns; the file, the line and the name stand before what goes wrong in it.
  template <class Call>
  auto at(const toml::node& node, const std::string& name, const Call& call) const {
    try {
      return call();
    } catch (const InputError& error) {
      fail(node, fmt::format("{}: {}", name, error.what()));
    }
  }

  double number_above_0(const toml::node& node, const std::string& name) const {
    const auto value = node.value<double>();
    if (!value || !(*value > 0) || !std::isfinite(*value)) {
      fail(node, fmt::format("{}: give a number above 0", name));
    }
    return *value;
  }

  std::string text(const toml::node& node, const std::string& name) const {
    const auto value = node.value<std::string>();
    if (!value || value->empty()) fail(node, fmt::format("{}: give a text", name));
    return *value;
  }

  film::Step step_of(const toml::node& node) const {
    const std::string word = text(node, "step");
    return at(node, "step", [&] { return film::step_named(word); });
  }

  film::Loop loop_of(const toml::node& node, const std::string& name) const {
    const std::string word = text(node, name);
    return at(node, name, [&] { return film::loop_named(word); });
  }

  void read_film(const toml::table& root) {
    const auto* const film = root["film"].as_table();
    if (film == nullptr) {
      throw InputError(
          fmt::format("'{}' has no [film] with a map and its seconds", file_.string()));
    }
    const std::size_t before = problems_.size();
    for (auto&& [key, node] : *film) {
      attempt([&, &word = node, name = std::string(key.str())] { read_entry(name, word); });
    }
    if (problems_.size() > before) return;
    if (film->contains("map") && film->contains("maps")) {
      fail(*film, "[film] has 'map' and 'maps'; give one of them");
    }
    if (script_.input.empty()) fail(*film, "[film] has no map; name the map or mesh to film");
    if (script_.seconds == 0) fail(*film, "[film] has no seconds; give the film's length");
    if (wanted_seconds_ > 0) {
      stretch_ = wanted_seconds_ / script_.seconds;
      script_.seconds = wanted_seconds_;
    }
    if (script_.seconds * script_.rate > static_cast<double>(kMostPictures)) {
      fail(*film, fmt::format("the film would have more than {} pictures; give fewer seconds or a "
                              "lower rate",
                              kMostPictures));
    }
  }

  /// An entry of [film].
  void read_entry(const std::string& name, const toml::node& node) {
    if (name == "map" && node.is_table()) {
      if (const auto made = made_.read(*node.as_table(), name, MadeCount::one)) {
        script_.input = made->string();
        script_.made = made_.maps();
      }
    } else if (name == "map") {
      script_.input = (file_.parent_path() / text(node, name)).string();
    } else if (name == "maps") {
      read_maps(node);
    } else if (name == "seconds") {
      script_.seconds = number_above_0(node, name);
    } else if (name == "rate") {
      script_.rate = number_above_0(node, name);
    } else if (name == "shutter") {
      const auto share = node.value<double>();
      if (!share || !(*share >= 0 && *share <= 1)) {
        fail(node, "shutter: give a share of a picture's time, 0 to 1");
      }
      script_.shutter = *share;
    } else if (name == "step") {
      step_ = step_of(node);
    } else if (name == "loop") {
      loop_ = loop_of(node, name);
    } else if (name == "keys") {
      script_.keys = (file_.parent_path() / text(node, name)).string();
    } else {
      fail(node,
           fmt::format("'{}' is not known in [film]; it has map, maps, seconds, rate, shutter, "
                       "step, loop and keys",
                       name));
    }
  }

  void read_maps(const toml::node& node) {
    has_several_ = true;
    if (const auto* const table = node.as_table()) {
      const auto made = made_.read(*table, "maps", MadeCount::several);
      if (!made) return;
      script_.made = made_.maps();
      script_.input = *made / "*.json";  // until they are made
      if (script_.has_maps()) show_maps(node, *made, "*.json");
    } else {
      show_maps(node, file_.parent_path(), text(node, "maps"));
    }
  }

  void show_maps(const toml::node& node, const std::filesystem::path& folder,
                 const std::string& pattern) {
    for (const auto& file : base::files_matching(folder, pattern)) {
      script_.maps.push_back(file.string());
    }
    std::ranges::sort(script_.maps, base::comes_before);
    if (script_.maps.empty()) {
      fail(node, fmt::format("maps: no file matches '{}', seen from the script", pattern));
    }
    for (const std::string& map : script_.maps) at(node, "maps", [&] { expect_map("it", map); });
    script_.input = script_.maps.front();
  }

  void read_options(const toml::table& options) {
    std::ostringstream json;
    json << toml::json_formatter(options);
    script_.options = nlohmann::json::parse(json.str());
    at(options, "[options]", [&] {
      find_files(script_.options, command_usage("render"), file_.parent_path());
      return script_.base();
    });
  }

  int whole_number(const toml::node& node, const std::string& name, int most) const {
    const auto value = node.value_exact<std::int64_t>();
    if (!value || *value < 1 || *value > most) {
      fail(node, fmt::format("{}: give a whole number, 1 to {}", name, most));
    }
    return static_cast<int>(*value);
  }

  /// Once all else is known.
  void read_dive(const toml::table& table) {
    int portal = 1;
    for (auto&& [key, node] : table) {
      attempt([&, &word = node, name = std::string(key.str())] {
        if (name == "portal") {
          portal = whole_number(word, name, kMostPortals);
        } else if (name == "copies") {
          script_.copies = whole_number(word, name, kMostCopies);
        } else {
          fail(word, fmt::format("'{}' is not known in [dive]; it has portal and copies", name));
        }
      });
    }
    for (const char* const name : kMovedByDive) {
      if (const auto found = script_.tracks.find(name); found != script_.tracks.end()) {
        attempt([&] {
          throw InputError(fmt::format("{}: {}: a [dive] leaves no room for keys of it",
                                       found->second.place(0), name));
        });
      }
    }
    if (has_several_) {
      attempt(
          [&] { fail(table, "a [dive] goes into a portal of one map; give 'map' for 'maps'"); });
    }
    if (static_cast<double>(script_.pictures()) * script_.copies >
        static_cast<double>(kMostPictures)) {
      fail(table, fmt::format("the film would have more than {} pictures; give fewer copies",
                              kMostPictures));
    }
    if (!problems_.empty() || !script_.has_maps()) return;
    at(table, fmt::format("[dive]: portal {}", portal), [&] {
      expect_map("it", script_.input);
      const Map map = read_map(script_.input);
      const View base = script_.base();
      const MapKnobs& knobs = base.map_options.knobs;
      if (knobs.rotate || knobs.translate || knobs.scale) {
        throw InputError(
            "it would be moved by the options rotate, translate and scale; leave them "
            "out, and turn the map with 'qjulia convert' first");
      }
      script_.dive.emplace(map, static_cast<std::size_t>(portal),
                           base.picture.camera.up.value_or(map.frame.up.value_or(kDefaultUp)));
    });
  }

  const MovingSetting& setting_of(const std::string& name) const {
    if (name == kAlongMaps) {
      if (has_several_) return along_maps();
      throw InputError("the film has one map; give a folder of them as 'maps' in [film]");
    }
    const auto found = moving_settings().find(base::dashed(name));
    if (found != moving_settings().end()) return found->second;
    std::vector<std::string> names;
    if (has_several_) names.emplace_back(kAlongMaps);
    for (const auto& [known, setting] : moving_settings()) names.push_back(known);
    throw InputError(
        fmt::format("there is no such setting to move; it can be {}", fmt::join(names, ", ")));
  }

  /// A share, 0 to 1, of the way from the first map to the last.
  static const MovingSetting& along_maps() {
    static const MovingSetting setting{kAlongMaps, 1, Interpolation::linear, true, {}};
    return setting;
  }

  /// @param time none where it cannot be read: the value is then checked alone. @param place where
  /// the value stands
  void add_key(const std::string& name, std::optional<double> time, std::vector<double> value,
               film::Step step, std::string place) {
    const MovingSetting& setting = setting_of(name);
    if (value.size() != setting.numbers) {
      throw InputError(fmt::format("give {}", setting.numbers == 1
                                                  ? "a number"
                                                  : fmt::format("{} numbers", setting.numbers)));
    }
    film::expect_value(value, setting.interpolation);
    if (name == kAlongMaps && !(value[0] >= 0 && value[0] <= 1)) {
      throw InputError("give 0 for the first map, 1 for the last, or a share of the way");
    }
    if (!time) return;
    is_geodesic_ = is_geodesic_ || step == film::Step::geodesic;
    keys_[base::dashed(name)].push_back(
        {stretch_ * *time, std::move(value), step, std::move(place)});
  }

  void read_key(const toml::table& table) {
    const auto time = table["at"].value<double>();
    film::Step step = step_;
    attempt([&] {
      if (!time || !std::isfinite(*time)) fail(table, "this [[key]] has no 'at', in seconds");
    });
    if (const toml::node* const word = table.get("step")) {
      attempt([&] { step = step_of(*word); });
    }
    for (auto&& [key, node] : table) {
      const std::string name(key.str());
      if (name == "at" || name == "step") continue;
      attempt([&, &value = node] {
        at(value, name, [&] { add_key(name, time, numbers_of(value), step, place_of(value)); });
      });
    }
  }

  /// A table whose first row has names, "at" the first of them; an empty cell is no key.
  void read_key_file(const std::string& path) {
    const std::string content = script_text(path, "table of keys");
    std::vector<KeyRow> rows;
    try {
      rows = rows_of(base::without_byte_order_mark(content));
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}:{}", path, error.what()));
    }
    if (rows.empty() || rows.front().cells.front() != "at") {
      throw InputError(fmt::format("{}:{}: the first column is to be 'at', in seconds", path,
                                   rows.empty() ? 1 : rows.front().line));
    }
    const KeyRow& head = rows.front();
    const std::string place = fmt::format("{}:{}", path, head.line);
    std::vector<bool> is_known(head.cells.size());
    for (std::size_t i = 1; i < head.cells.size(); ++i) {
      const std::string& name = head.cells[i];
      attempt([&] {
        named(place, name.empty() ? fmt::format("column {}", i + 1) : name, [&] {
          if (name.empty()) throw InputError("it has no name");
          setting_of(name);
          if (std::find(head.cells.begin(), head.cells.begin() + static_cast<std::ptrdiff_t>(i),
                        name) != head.cells.begin() + static_cast<std::ptrdiff_t>(i)) {
            throw InputError("it has two columns");
          }
        });
        is_known[i] = true;
      });
    }
    for (std::size_t i = 1; i < rows.size(); ++i) {
      read_row(head.cells, is_known, rows[i], fmt::format("{}:{}", path, rows[i].line));
    }
  }

  /// Makes the call, and puts a place and a name before its error.
  template <class Call>
  static void named(const std::string& place, const std::string& name, const Call& call) {
    try {
      call();
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}: {}", place, name, error.what()));
    }
  }

  void read_row(const std::vector<std::string>& names, const std::vector<bool>& is_known,
                const KeyRow& row, const std::string& place) {
    attempt([&] {
      if (row.cells.size() <= names.size()) return;
      throw InputError(
          fmt::format("{}: the row has more cells than the first one; numbers have a "
                      "point, not a comma",
                      place));
    });
    std::optional<double> time;
    attempt([&] { named(place, names[0], [&] { time = number_of_cell(row.cells[0]); }); });
    for (std::size_t i = 1; i < std::min(row.cells.size(), names.size()); ++i) {
      if (row.cells[i].empty() || !is_known[i]) continue;
      attempt([&] {
        named(place, names[i], [&] {
          std::vector<double> value;
          for (const std::string& word : base::split(row.cells[i], ' ')) {
            if (!word.empty()) value.push_back(number_of_cell(word));
          }
          add_key(names[i], time, std::move(value), step_, place);
        });
      });
    }
  }

  void make_tracks(const toml::table* loops) {
    std::map<std::string, film::Loop> by_name;
    const bool are_all_read = problems_.empty();  // else a key may be left out because of its error
    if (loops != nullptr) {
      for (auto&& [key, node] : *loops) {
        attempt([&, &word = node, name = base::dashed(std::string(key.str()))] {
          if (are_all_read && !keys_.contains(name))
            fail(word, fmt::format("'{}' has no key to loop", name));
          by_name[name] = loop_of(word, name);
        });
      }
    }
    std::map<std::string, std::string> names;  // of tracks, by their options
    for (auto& [name, keys] : keys_) {
      const auto found = by_name.find(name);
      const std::string place = keys.front().place;
      try {
        const MovingSetting& setting = setting_of(name);
        if (setting.is_of_map && !script_.input.empty()) expect_map("it", script_.input);
        const auto [other, is_new] = names.emplace(setting.of, name);
        if (!is_new && setting.of != "cut") {
          throw InputError(fmt::format("'{}' moves the same; give keys of one", other->second));
        }
        film::Track track(std::move(keys), setting.interpolation,
                          found == by_name.end() ? loop_ : found->second);
        if (name == kAlongMaps) {
          script_.along_maps = std::move(track);
        } else {
          script_.tracks.emplace(name, std::move(track));
        }
      } catch (const InputError& error) {
        problems_.push_back(fmt::format("{}: {}: {}", place, name, error.what()));
      }
    }
  }

  std::filesystem::path file_;
  double wanted_seconds_, stretch_ = 1;
  film::Step step_ = film::Step::spline;
  film::Loop loop_ = film::Loop::hold;
  std::map<std::string, std::vector<film::Key>> keys_;
  bool is_geodesic_ = false;           ///< some key has that step
  bool has_several_ = false;           ///< maps
  std::vector<std::string> problems_;  ///< told all at once
  MadeMapReader made_;
  FilmScript script_;
};

}  // namespace

FilmScript read_film_script(const ScriptPlace& place) { return ScriptReader(place).read(); }

FilmScript with_maps(const FilmScript& script, const Device& device, Session& session) {
  if (script.has_maps()) return script;
  make_maps(script.made, device, session);
  return read_film_script(script.place);
}

std::filesystem::path made_folder(const std::filesystem::path& script,
                                  const std::filesystem::path& output) {
  return output.parent_path() / (script.stem().string() + ".made");
}

ScriptPlan script_plan(const std::string& file, double seconds, base::Output output) {
  ScriptPlan plan;
  plan.script = read_film_script({file, seconds, made_folder(file, output.path)});
  static_cast<void>(plan.script.views(plan.script.base()));  // which may be refused
  plan.inputs = {file};
  for (const auto& [name, path] : plan.script.files()) plan.inputs.push_back(path);
  plan.further_inputs = plan.script.files();
  plan.outputs = {std::move(output)};
  return plan;
}

}  // namespace qjulia::tools
