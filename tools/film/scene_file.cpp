#include "film/scene_file.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <numbers>

#include "base/output_file.hpp"
#include "base/text.hpp"

namespace qjulia::film {
namespace {

using nlohmann::json;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kLampWatts = 3;    ///< a square metre, of a lamp of strength 1
constexpr double kLumens = 683;     ///< in a watt
constexpr double kFilmHeight = 24;  ///< millimetres

/// Axes of something that looks against its third axis, as cameras and lamps of both formats do,
/// in the file, whose Y is up.
Eigen::Matrix3d in_file(const FilmScene& scene, const Eigen::Matrix3d& axes) {
  return quarter_turns(scene.up, UpAxis::y) * axes;
}

Eigen::Matrix3d axes_of(const LampPose& lamp) {
  Eigen::Matrix3d axes;
  const Eigen::Vector3d right = lamp.towards.unitOrthogonal();
  axes << right, lamp.towards.cross(right), lamp.towards;
  return axes;
}

struct Placed {
  Eigen::Vector3d place;
  Eigen::Quaterniond turn;
};

/// One thing in every picture. Turns of neighbours are nearest to each other: readers go straight
/// from one to the next.
using Course = std::vector<Placed>;

void add(Course& course, const Eigen::Vector3d& place, const Eigen::Matrix3d& axes) {
  Eigen::Quaterniond turn(axes);
  if (!course.empty() && turn.dot(course.back().turn) < 0) turn.coeffs() *= -1;
  course.push_back({place, turn});
}

Course camera_course(const FilmScene& scene) {
  Course course;
  for (const CameraPose& camera : scene.cameras) {
    add(course, quarter_turns(scene.up, UpAxis::y) * camera.eye, in_file(scene, camera.axes));
  }
  return course;
}

/// The lamp's place means nothing: its light is parallel.
Course lamp_course(const FilmScene& scene, std::size_t number) {
  Course course;
  for (const auto& lamps : scene.lamps) {
    add(course, Eigen::Vector3d::Zero(), in_file(scene, axes_of(lamps.at(number))));
  }
  return course;
}

bool is_still(const Course& course) {
  return std::ranges::all_of(course, [&](const Placed& placed) {
    return placed.place == course.front().place &&
           placed.turn.coeffs() == course.front().turn.coeffs();
  });
}

double strongest(const LampPose& lamp) { return std::max(lamp.color.maxCoeff(), 1e-9); }

/// A buffer of floats, and what the JSON says of its parts.
struct GlbBuffer {
  std::string bytes;
  json views = json::array(), accessors = json::array();

  void add(double value) {
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(bits >> shift & 0xff);
  }
  /// @return the number of the accessor of what `fill` adds
  template <class Fill>
  std::size_t part(std::size_t count, const char* shape, const Fill& fill) {
    const std::size_t begin = bytes.size();
    fill();
    views.push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes.size() - begin}});
    constexpr int kFloat = 5126;
    accessors.push_back({{"bufferView", views.size() - 1},
                         {"componentType", kFloat},
                         {"count", count},
                         {"type", shape}});
    return accessors.size() - 1;
  }
};

/// The parts of a .glb of the scene.
class GlbScene {
 public:
  explicit GlbScene(const FilmScene& scene) : scene_(scene) {
    const CameraPose& first = scene.cameras.front();
    add_node("camera", camera_course(scene), {{"camera", 0}});
    about_["cameras"] = {{{"type", "perspective"},
                          {"perspective",
                           {{"yfov", first.field_of_view / kDegrees},
                            {"aspectRatio", scene.aspect},
                            {"znear", 0.001}}}}};
    json lights = json::array();
    for (std::size_t i = 0; i < scene.lamps.front().size(); ++i) {
      const LampPose& lamp = scene.lamps.front()[i];
      const Rgb color = lamp.color / strongest(lamp);
      lights.push_back({{"type", "directional"},
                        {"name", fmt::format("lamp{}", i + 1)},
                        {"color", {color[0], color[1], color[2]}},
                        {"intensity", kLumens * kLampWatts * lamp.strength * strongest(lamp)}});
      add_node(fmt::format("lamp{}", i + 1), lamp_course(scene, i),
               {{"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
    }
    if (lights.empty()) return;
    about_["extensionsUsed"] = {"KHR_lights_punctual"};
    about_["extensions"] = {{"KHR_lights_punctual", {{"lights", lights}}}};
  }

  void write(const std::filesystem::path& path, const std::string& note) {
    about_["asset"] = {{"version", "2.0"}, {"generator", "qjulia"}};
    if (!note.empty()) about_["asset"]["extras"] = {{"made_with", note}};
    json numbers = json::array();
    for (std::size_t i = 0; i < nodes_.size(); ++i) numbers.push_back(i);
    about_["scene"] = 0;
    about_["scenes"] = {{{"nodes", numbers}}};
    about_["nodes"] = nodes_;
    if (!channels_.empty()) {
      about_["animations"] =
          json::array({json{{"name", "film"}, {"channels", channels_}, {"samplers", samplers_}}});
      about_["buffers"] = {{{"byteLength", buffer_.bytes.size()}}};
      about_["bufferViews"] = buffer_.views;
      about_["accessors"] = buffer_.accessors;
    }
    std::string text = about_.dump(-1, ' ', false, json::error_handler_t::replace);
    text.append((4 - text.size() % 4) % 4, ' ');
    const std::size_t binary = buffer_.bytes.empty() ? 0 : 8 + buffer_.bytes.size();
    std::string file;
    const auto word = [&](std::size_t value) {
      for (int shift = 0; shift < 32; shift += 8) file += static_cast<char>(value >> shift & 0xff);
    };
    constexpr std::size_t kMagic = 0x46546C67, kJson = 0x4E4F534A, kBinary = 0x004E4942;
    for (const std::size_t value :
         {kMagic, std::size_t{2}, 12 + 8 + text.size() + binary, text.size(), kJson}) {
      word(value);
    }
    file += text;
    if (binary > 0) {
      word(buffer_.bytes.size());
      word(kBinary);
      file += buffer_.bytes;
    }
    base::write_file(path, file);
  }

 private:
  void add_node(const std::string& name, const Course& course, json node) {
    const auto& [place, turn] = course.front();
    node["name"] = name;
    node["translation"] = {place.x(), place.y(), place.z()};
    node["rotation"] = {turn.x(), turn.y(), turn.z(), turn.w()};
    nodes_.push_back(std::move(node));
    if (is_still(course)) return;
    if (channels_.empty()) {
      times_ = buffer_.part(course.size(), "SCALAR", [&] {
        for (std::size_t i = 0; i < course.size(); ++i) {
          buffer_.add(static_cast<double>(i) / scene_.rate);
        }
      });
      const double end = static_cast<double>(course.size() - 1) / scene_.rate;
      buffer_.accessors.back()["min"] = {0};
      buffer_.accessors.back()["max"] = {static_cast<float>(end)};
    }
    add_channel("translation", buffer_.part(course.size(), "VEC3", [&] {
      for (const Placed& placed : course) {
        for (const double c : placed.place) buffer_.add(c);
      }
    }));
    add_channel("rotation", buffer_.part(course.size(), "VEC4", [&] {
      for (const Placed& placed : course) {
        for (const double c : placed.turn.coeffs()) buffer_.add(c);
      }
    }));
  }

  void add_channel(const char* path, std::size_t values) {
    channels_.push_back(
        {{"sampler", samplers_.size()}, {"target", {{"node", nodes_.size() - 1}, {"path", path}}}});
    samplers_.push_back({{"input", times_}, {"output", values}, {"interpolation", "LINEAR"}});
  }

  const FilmScene& scene_;
  json about_ = json::object(), nodes_ = json::array(), channels_ = json::array(),
       samplers_ = json::array();
  GlbBuffer buffer_;
  std::size_t times_ = 0;
};

/// USD multiplies rows: the transpose of what multiplies columns.
std::string usd_matrix(const Placed& placed) {
  const Eigen::Matrix3d turn = placed.turn.toRotationMatrix();
  std::string rows;
  for (int column = 0; column < 3; ++column) {
    rows += fmt::format("({}, {}, {}, 0), ", turn(0, column), turn(1, column), turn(2, column));
  }
  const Eigen::Vector3d& x = placed.place;
  return fmt::format("( {}({}, {}, {}, 1) )", rows, x.x(), x.y(), x.z());
}

/// An attribute with a value, or with one for each picture. @param value of picture number i
template <class Value>
std::string usd_values(const std::string& name, std::size_t count, bool is_still,
                       const Value& value) {
  if (is_still) return fmt::format("    {} = {}\n", name, value(0));
  std::string text = fmt::format("    {}.timeSamples = {{\n", name);
  for (std::size_t i = 0; i < count; ++i) text += fmt::format("        {}: {},\n", i, value(i));
  return text + "    }\n";
}

std::string usd_place(const Course& course) {
  return usd_values("matrix4d xformOp:transform", course.size(), is_still(course),
                    [&](std::size_t i) { return usd_matrix(course[i]); }) +
         "    uniform token[] xformOpOrder = [\"xformOp:transform\"]\n";
}

std::string usd_text(const FilmScene& scene, const std::string& note) {
  std::string plain = note;
  for (char& c : plain) {
    if (c < ' ' || c > '~') c = '?';
  }
  std::string text = fmt::format(
      "#usda 1.0\n(\n    doc = {}\n    startTimeCode = 0\n    endTimeCode = {}\n"
      "    timeCodesPerSecond = {}\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n"
      "def Camera \"camera\"\n{{\n    float2 clippingRange = (0.001, 100000)\n",
      json(plain).dump(), scene.cameras.size() - 1, scene.rate);
  const auto focal_length = [&](std::size_t i) {
    return kFilmHeight / 2 / std::tan(scene.cameras[i].field_of_view / 2 / kDegrees);
  };
  text += usd_values("float focalLength", scene.cameras.size(), fits_glb(scene), focal_length);
  text += fmt::format(
      "    float horizontalAperture = {}\n    float verticalAperture = {}\n"
      "    token projection = \"perspective\"\n{}}}\n",
      scene.aspect * kFilmHeight, kFilmHeight, usd_place(camera_course(scene)));
  for (std::size_t i = 0; i < scene.lamps.front().size(); ++i) {
    const LampPose& lamp = scene.lamps.front()[i];
    const Rgb color = lamp.color / strongest(lamp);
    text += fmt::format(
        "\ndef DistantLight \"lamp{}\"\n{{\n    float inputs:angle = {}\n"
        "    color3f inputs:color = ({}, {}, {})\n    float inputs:intensity = {}\n{}}}\n",
        i + 1, 2 * lamp.size, color[0], color[1], color[2],
        kLampWatts * lamp.strength * strongest(lamp), usd_place(lamp_course(scene, i)));
  }
  return text;
}

}  // namespace

bool fits_glb(const FilmScene& scene) {
  return std::ranges::all_of(scene.cameras, [&](const CameraPose& camera) {
    constexpr double kRounding = 1e-9;  // degrees
    return std::abs(camera.field_of_view - scene.cameras.front().field_of_view) < kRounding;
  });
}

void write_scene(const FilmScene& scene, const std::filesystem::path& path,
                 const std::string& note) {
  if (base::extension_of(path) == ".glb") {
    GlbScene(scene).write(path, note);
  } else {
    base::write_file(path, usd_text(scene, note));
  }
}

}  // namespace qjulia::film
