#include "explore/request.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/file_types.hpp"
#include "base/text.hpp"
#include "qjulia/base/colors.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/picture/look.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia::explore {
namespace {

template <class Number>
constexpr const char* kExpected =
    std::is_floating_point_v<Number> ? "a number"
    : std::is_signed_v<Number>       ? "a whole number"
                                     : "a whole number that is not negative";

/// @throws InputError for anything else than a finite number
template <class Number>
Number query_number(std::string_view text) {
  const auto value = base::number_in<Number>(text);
  if (value && std::isfinite(static_cast<double>(*value))) return *value;
  throw InputError(fmt::format("'{}' cannot be used; give {}", text, kExpected<Number>));
}

/// `count` numbers with commas between them.
std::vector<double> numbers(std::string_view text, std::size_t count) {
  std::vector<double> values;
  for (const std::string& word : base::split(text, ',')) {
    values.push_back(query_number<double>(word));
  }
  if (values.size() == count) return values;
  throw InputError(fmt::format("give {} numbers with commas between them", count));
}

bool query_flag(std::string_view text) {
  if (text == "0" || text == "1") return text == "1";
  throw InputError(fmt::format("'{}' cannot be used; give 0 or 1", text));
}

/// Reads a value of each type from the text of a query.
class ReadText {
 public:
  ReadText(const Setting& setting, std::string_view text) : setting_(setting), text_(text) {}

  template <class Number>
  requires std::is_arithmetic_v<Number>
  void operator()(Number* value) const { *value = query_number<Number>(text_); }
  void operator()(bool* value) const { *value = query_flag(text_); }
  void operator()(std::string* value) const { *value = text_; }
  void operator()(const WordPlace& value) const { value.set(setting_.index_of(text_)); }
  void operator()(const SizePlace& size) const { size.read(text_); }
  void operator()(std::vector<Cut>* value) const { *value = cuts_from(std::string(text_)); }
  void operator()(MaterialRange* value) const { *value = range_from(std::string(text_)); }
  void operator()(DetailChoice* value) const {
    const auto word = detail_word_named(text_);
    *value = word ? DetailChoice(*word) : DetailChoice(query_number<double>(text_));
  }
  void operator()(Eigen::Vector3d* value) const {
    const std::vector<double> v = numbers(text_, 3);
    *value = {v[0], v[1], v[2]};
  }
  void operator()(std::vector<Lamp>* value) const {
    value->clear();
    for (const std::string& lamp : base::split(text_, ';')) value->push_back(lamp_from(lamp));
  }
  void operator()(LightColor* value) const { *value = light_color_from(text_); }
  void operator()(Background* value) const { *value = background_from(text_); }
  void operator()(Quaternion* value) const {
    const std::vector<double> v = numbers(text_, 4);
    *value = {v[0], v[1], v[2], v[3]};
  }
  void operator()(Rotation* value) const {
    const std::vector<double> v = numbers(text_, 4);
    *value = {{v[0], v[1], v[2]}, v[3]};
  }
  void operator()(Box* value) const {
    const std::vector<double> v = numbers(text_, 6);
    *value = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
  }
  void operator()(Palette* value) const {
    const auto palette = palette_named(text_);
    if (!palette) throw InputError("give the name of a palette");
    *value = *palette;
  }
  void operator()(UpAxis* value) const {
    const auto up = up_axis_named(text_);
    if (!up) throw InputError("give x, y, z, -x, -y or -z");
    *value = *up;
  }
  template <class Value>
  void operator()(std::optional<Value>* value) const {
    if (!setting_.automatic.empty() && text_ == setting_.automatic) {
      value->reset();
    } else {
      operator()(&value->emplace());
    }
  }

 private:
  const Setting& setting_;
  std::string_view text_;
};

/// @throws InputError
void read_setting(std::string_view text, const Setting& setting, const ValuePlace& place) {
  std::visit(ReadText(setting, text), place);
  try {
    expect_in_range(setting, place);
  } catch (const OptionError& error) {
    throw InputError(error.problem());  // the name of the query is put before it
  }
}

void read_size(std::string_view text, ViewRequest& view) {
  PictureOptions& picture = view.picture;
  const PictureSetting& setting = picture_setting_named("size");
  read_setting(text, setting, setting.place(picture));
  const bool is_sane =
      picture.width <= 16384 && picture.height <= ViewRequest::kMostPixels / picture.width;
  if (!is_sane) {
    throw InputError(fmt::format("give sides of 1 to 16384 pixels, {} in all at most",
                                 ViewRequest::kMostPixels));
  }
}

void read_samples(std::string_view text, ViewRequest& view) {
  int& samples = view.picture.samples;
  samples = query_number<int>(text);
  if (samples < 1 || samples > ViewRequest::kMostSamples) {
    throw InputError(fmt::format("give 1 to {}", ViewRequest::kMostSamples));
  }
}

void read_environment_name(std::string_view text, ViewRequest& view) {
  const auto names = environment_names();
  if (!text.empty() && std::ranges::count(names, text) == 0) {
    throw InputError(fmt::format("give one of {}", fmt::join(names, ", ")));
  }
  view.picture.light.environment = text;
}

Eigen::Vector2d place_in(std::string_view text) {
  const std::vector<double> v = numbers(text, 2);
  const auto is_inside = [](double share) { return share >= 0 && share <= 1; };
  if (!std::ranges::all_of(v, is_inside)) throw InputError("give shares of the sides, 0 to 1");
  return {v[0], v[1]};
}

void read_shows(std::string_view text, ViewRequest& view) {
  if (text != "map" && text != "mesh") throw InputError("give map or mesh");
  view.shows_mesh = text == "mesh";
}

/// What one name of a query does.
struct Part {
  enum class Changes { knobs, studio, size, camera } changes;
  std::function<void(std::string_view, ViewRequest&)> take;
};

using Changes = Part::Changes;

Part part_of(const Knob& knob) {
  return {Changes::knobs, [&knob](std::string_view text, ViewRequest& view) {
            read_setting(text, knob, knob.place(view.knobs));
          }};
}

Part part_of(const PictureSetting& setting) {
  return {setting.is_of_camera ? Changes::camera : Changes::studio,
          [&setting](std::string_view text, ViewRequest& view) {
            read_setting(text, setting, setting.place(view.picture));
          }};
}

using Parts = std::map<std::string, Part, std::less<>>;

const Parts& parts() {
  static const Parts all = [] {
    Parts made{
        {"draft",
         {Changes::studio, [](auto text, auto& view) { view.is_draft = query_flag(text); }}},
        {"steady",
         {Changes::camera, [](auto text, auto& view) { view.is_steady = query_flag(text); }}},
        {"apart",
         {Changes::camera, [](auto text, auto& view) { view.is_apart = query_flag(text); }}},
        {"at", {Changes::camera, [](auto text, auto& view) { view.at = place_in(text); }}},
        {"size", {Changes::size, read_size}},
        {"samples", {Changes::studio, read_samples}},
        {"shows", {Changes::studio, read_shows}}};
    for (const Knob& knob : knob_table()) made.emplace(knob.option(), part_of(knob));
    for (const PictureSetting& setting : picture_settings()) {
      made.emplace(setting.option(), part_of(setting));
    }
    // No request makes the server read a file.
    made["look"] = {Changes::studio,
                    [](auto text, auto& view) { apply_built_in_look(view.picture, text); }};
    made["environment"] = {Changes::studio, read_environment_name};
    return made;
  }();
  return all;
}

/// What `call` returns; what goes wrong in it names the name.
template <class Call>
auto naming(const std::string& name, const Call& call) {
  try {
    return call();
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", name, error.what()));
  }
}

/// The value of a name that may be given once, taken out of the query.
std::optional<std::string> taken(Query& query, const std::string& name) {
  if (query.count(name) > 1) throw InputError(fmt::format("'{}' is given twice", name));
  const auto node = query.extract(name);
  if (node.empty()) return std::nullopt;
  return node.mapped();
}

template <class Number>
Number number_between(std::string_view text, Number least, Number most) {
  const auto value = query_number<Number>(text);
  if (value >= least && value <= most) return value;
  throw InputError(fmt::format("{} is out of range; give {} to {}", value, least, most));
}

/// A file's type without its dot, or "turntable".
void read_product(std::string_view text, MakeRequest& made) {
  constexpr std::string_view kTurntable = "turntable";
  made.is_turntable = text == kTurntable;
  made.extension = fmt::format(".{}", text);
  auto types = base::extensions(base::FileContent::mesh, base::FileUse::write);
  types.emplace_back(".png");
  if (made.is_turntable || std::ranges::count(types, made.extension) > 0) return;
  std::string names;
  for (const std::string& extension : types) names += extension.substr(1) + ", ";
  throw InputError(fmt::format("give one of {}{}", names, kTurntable));
}

/// What a name of a request to make a file does, besides those of views.
using MakePart = std::function<void(std::string_view, MakeRequest&)>;

const std::map<std::string, MakePart, std::less<>>& make_parts() {
  static const std::map<std::string, MakePart, std::less<>> all{
      {"make", read_product},
      {"resolution",
       [](auto text, auto& made) {
         made.resolution = number_between(text, 16, MakeRequest::kMostCells);
       }},
      {"millimetres",
       [](auto text, auto& made) { made.millimetres = number_between(text, 1e-3, 1e5); }},
      {"frames", [](auto text, auto& made) {
         made.frames = number_between(text, 2, MakeRequest::kMostFrames);
       }}};
  return all;
}

void read_places(std::string_view text, BrushRequest& brush) {
  const auto places = base::split(text, ';');
  if (places.size() > BrushRequest::kMostPlaces) {
    throw InputError(fmt::format("give at most {} places", BrushRequest::kMostPlaces));
  }
  for (const std::string& place : places) brush.places.push_back(place_in(place));
}

/// What a name of a request to the brush does, besides those of views.
using BrushPart = std::function<void(std::string_view, BrushRequest&)>;

const std::map<std::string, BrushPart, std::less<>>& brush_parts() {
  static const std::map<std::string, BrushPart, std::less<>> all{
      {"places", read_places},
      {"radius", [](auto text, auto& brush) { brush.radius = number_between(text, 1e-3, 1.0); }},
      {"share", [](auto text, auto& brush) { brush.share = number_between(text, 0.0, 1.0); }},
      {"copy", [](auto text, auto& brush) { brush.copy = query_number<double>(text); }}};
  return all;
}

/// The names of a table, with commas between them.
template <class Table>
std::string names_of(const Table& table) {
  std::string names;
  for (const auto& [name, part] : table) names += (names.empty() ? "" : ", ") + name;
  return names;
}

/// @param names that the request may have.
ViewRequest view_of(const Query& query, const std::string& names) {
  ViewRequest view;
  view.picture.samples = 1;
  std::string size_text;
  // A look first, so that other settings hold over it.
  std::vector<std::pair<std::string, std::string>> given(query.begin(), query.end());
  std::stable_partition(given.begin(), given.end(),
                        [](const auto& each) { return each.first == "look"; });
  for (const auto& [name, value] : given) {
    const auto found = parts().find(name);
    if (found == parts().end()) {
      throw InputError(fmt::format("a request has an unknown name; it takes {}", names));
    }
    if (query.count(name) > 1) throw InputError(fmt::format("'{}' is given twice", name));
    const auto& [changes, take] = found->second;
    naming(name, [&, &read_part = take, &text = value] { read_part(text, view); });
    const std::string part = fmt::format("{}={}&", name, value);
    if (changes == Changes::knobs) view.knobs_text += part;
    if (changes == Changes::knobs || changes == Changes::studio) view.studio_text += part;
    if (changes == Changes::size) size_text = part;
  }
  // Drafts of all sizes stand in the same light.
  if (!view.is_draft) view.studio_text += size_text;
  return view;
}

/// Reads the names of a table, and the view that the others ask for.
template <class Table, class Request>
void read_besides(const Table& table, Query& query, Request& request) {
  for (const auto& [name, take] : table) {
    const auto text = taken(query, name);
    if (text) naming(name, [&, &read_part = take] { read_part(*text, request); });
  }
  request.view = view_of(query, fmt::format("{}, {}", names_of(table), names_of(parts())));
}

}  // namespace

ViewRequest read_view(const Query& query) { return view_of(query, names_of(parts())); }

MakeRequest read_make(Query query) {
  MakeRequest made;
  if (!query.contains("make")) query.emplace("make", "");  // the error then lists the values
  read_besides(make_parts(), query, made);
  const PictureOptions& picture = made.view.picture;
  const bool is_printed =
      base::has_type("made" + made.extension, base::FileContent::mesh, base::FileUse::print);
  if (is_printed && !picture.cuts.empty()) {
    throw InputError(
        "a set that is cut open is not closed, and cannot be printed: set x, y and z under 'Cut "
        "open' to 100, or make another file");
  }
  if (made.is_turntable &&
      picture.height > MakeRequest::kMostPixels / picture.width / made.frames) {
    throw InputError("so many pictures are too large for a page: give fewer, or a smaller size");
  }
  return made;
}

BrushRequest read_brush(Query query) {
  BrushRequest brush;
  read_besides(brush_parts(), query, brush);
  if (brush.copy && brush.places.size() != 1) {
    throw InputError("places: give exactly one place for a copy");
  }
  const PictureOptions& picture = brush.view.picture;
  if (picture.height > BrushRequest::kMostPixels / picture.width || picture.samples > 1) {
    throw InputError(fmt::format("size: points are looked for in at most {} pixels of one sample",
                                 BrushRequest::kMostPixels));
  }
  return brush;
}

std::string message_of(const OptionError& error) {
  std::string name = error.field();
  std::ranges::replace(name, '_', '-');
  return fmt::format("{}: {}", name, error.problem());
}

}  // namespace qjulia::explore
