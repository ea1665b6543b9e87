#include "explore/view_request.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>
#include <vector>

#include "explore/query_number.hpp"
#include "qjulia/colors.hpp"
#include "qjulia/error.hpp"

namespace qjulia::explore {
namespace {

/// `count` numbers with commas between them.
std::vector<double> numbers(std::string_view text, std::size_t count) {
  std::vector<double> values;
  for (std::size_t from = 0; from <= text.size() && values.size() <= count;) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    values.push_back(query_number<double>(text.substr(from, comma - from)));
    from = comma + 1;
  }
  if (values.size() == count) return values;
  throw InputError(fmt::format("give {} numbers with commas between them", count));
}

Eigen::Vector3d vector(std::string_view text) {
  const std::vector<double> v = numbers(text, 3);
  return {v[0], v[1], v[2]};
}

void read_size(std::string_view text, PictureOptions& picture) {
  const std::size_t x = text.find('x');
  if (x == std::string_view::npos) throw InputError("give WIDTHxHEIGHT");
  picture.width = query_number<int>(text.substr(0, x));
  picture.height = query_number<int>(text.substr(x + 1));
  const bool is_sane = picture.width > 0 && picture.height > 0 && picture.width <= 16384 &&
                       picture.height <= ViewRequest::kMostPixels / picture.width;
  if (!is_sane) throw InputError("it is too large for a page");
}

Material material(std::string_view text) {
  if (text == "clay") return Material::clay;
  if (text == "iterations") return Material::iterations;
  if (text == "trap") return Material::trap;
  throw InputError("give clay, iterations or trap");
}

UpAxis direction_named(std::string_view text) {
  if (const auto up = up_axis_named(text)) return *up;
  throw InputError("give x, y, z, -x, -y or -z");
}

/// What one name of a query does.
struct Part {
  enum class Changes { knobs, studio, size, camera } changes;
  std::function<void(std::string_view, ViewRequest&)> take;
};

using Changes = Part::Changes;

/// Cuts away what lies beyond a per cent of the shape's box.
Part cut(char axis) {
  return {Changes::studio, [axis](std::string_view text, ViewRequest& view) {
            view.picture.cuts.push_back({axis, query_number<double>(text), true});
          }};
}

const std::map<std::string, Part, std::less<>>& parts() {
  static const std::map<std::string, Part, std::less<>> all{
      {"detail",
       {Changes::knobs, [](auto text, auto& v) { v.knobs.detail = query_number<double>(text); }}},
      {"order-seed",
       {Changes::knobs,
        [](auto text, auto& v) { v.knobs.order_seed = query_number<std::uint64_t>(text); }}},
      {"phase",
       {Changes::knobs,
        [](auto text, auto& v) {
          const std::vector<double> p = numbers(text, 4);
          v.knobs.phase = Quaternion{p[0], p[1], p[2], p[3]};
        }}},
      {"slice",
       {Changes::knobs, [](auto text, auto& v) { v.knobs.slice = query_number<double>(text); }}},
      {"rotate",
       {Changes::knobs,
        [](auto text, auto& v) {
          const std::vector<double> r = numbers(text, 4);
          v.knobs.rotate = Rotation{{r[0], r[1], r[2]}, r[3]};
        }}},
      {"drift",
       {Changes::knobs, [](auto text, auto& v) { v.knobs.drift = query_number<double>(text); }}},
      {"scale",
       {Changes::knobs, [](auto text, auto& v) { v.knobs.scale = query_number<double>(text); }}},
      {"tufts",
       {Changes::knobs, [](auto text, auto& v) { v.knobs.tufts = query_number<double>(text); }}},
      {"iterations",
       {Changes::studio,
        [](auto text, auto& v) { v.picture.iterations = query_number<int>(text); }}},
      {"material",
       {Changes::studio, [](auto text, auto& v) { v.picture.material = material(text); }}},
      {"palette",
       {Changes::studio,
        [](auto text, auto& v) {
          const auto palette = palette_named(text);
          if (!palette) throw InputError("give the name of a palette");
          v.picture.palette = *palette;
        }}},
      {"lamp",
       {Changes::studio,
        [](auto text, auto& v) {
          const Eigen::Vector3d lamp = vector(text);
          v.picture.lamp = {lamp.x(), lamp.y(), lamp.z()};
        }}},
      {"size", {Changes::size, [](auto text, auto& v) { read_size(text, v.picture); }}},
      {"samples",
       {Changes::studio,
        [](auto text, auto& v) {
          v.picture.samples_per_axis = query_number<int>(text);
          if (v.picture.samples_per_axis > ViewRequest::kMostSamples) {
            throw InputError(fmt::format("give {} at most", ViewRequest::kMostSamples));
          }
        }}},
      {"shows",
       {Changes::studio,
        [](auto text, auto& v) {
          if (text != "map" && text != "mesh") throw InputError("give map or mesh");
          v.shows_mesh = text == "mesh";
        }}},
      {"draft",
       {Changes::studio,
        [](auto text, auto& v) { v.picture.draft = query_number<int>(text) != 0; }}},
      {"cut-x", cut('x')},
      {"cut-y", cut('y')},
      {"cut-z", cut('z')},
      {"up",
       {Changes::studio, [](auto text, auto& v) { v.picture.camera.up = direction_named(text); }}},
      {"azimuth",
       {Changes::camera,
        [](auto text, auto& v) { v.picture.camera.azimuth = query_number<double>(text); }}},
      {"elevation",
       {Changes::camera,
        [](auto text, auto& v) { v.picture.camera.elevation = query_number<double>(text); }}},
      {"zoom",
       {Changes::camera,
        [](auto text, auto& v) { v.picture.camera.zoom = query_number<double>(text); }}},
      {"look-at",
       {Changes::camera, [](auto text, auto& v) { v.picture.camera.look_at = vector(text); }}},
  };
  return all;
}

}  // namespace

ViewRequest read_view(const Query& query) {
  ViewRequest view;
  view.picture.samples_per_axis = 1;
  std::string size_text;
  for (const auto& [name, value] : query) {
    const auto found = parts().find(name);
    if (found == parts().end()) throw InputError("a request has an unknown name");
    if (query.count(name) > 1) throw InputError(fmt::format("'{}' is given twice", name));
    const auto& [changes, take] = found->second;
    try {
      take(value, view);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}", name, error.what()));
    }
    const std::string text = fmt::format("{}={}&", name, value);
    if (changes == Changes::knobs) view.knobs_text += text;
    if (changes == Changes::knobs || changes == Changes::studio) view.studio_text += text;
    if (changes == Changes::size) size_text = text;
  }
  // Drafts of all sizes stand in the same light.
  if (!view.picture.draft) view.studio_text += size_text;
  return view;
}

}  // namespace qjulia::explore
