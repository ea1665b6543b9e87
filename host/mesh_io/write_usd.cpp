#include "mesh_io/write_usd.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "base/srgb.hpp"
#include "mesh_io/formats.hpp"
#include "mesh_io/record_stream.hpp"

namespace qjulia::shape {
namespace {

/// Where pictures of this program are taken from, too.
constexpr double kAzimuth = 30, kElevation = 15;  // degrees
constexpr double kFilmWidth = 36, kFilmHeight = 24, kFocalLength = 45;

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// A name that a prim may have: letters, digits and underscores, no digit first.
std::string prim_name(const std::string& name) {
  std::string made;
  for (const char c : name) {
    const bool is_plain =
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    made += is_plain ? c : '_';
  }
  if (made.empty() || (made[0] >= '0' && made[0] <= '9')) made.insert(0, 1, '_');
  return made;
}

/// With its quotes: JSON's escapes are USD's too, as long as all is ASCII without control
/// characters.
std::string quoted(const std::string& text) {
  std::string plain = text;
  for (char& c : plain) {
    if (c < ' ' || c > '~') c = '?';
  }
  return nlohmann::json(plain).dump();
}

/// USD multiplies rows: the transpose of what multiplies columns.
std::string usd_matrix(const Eigen::Matrix4d& matrix) {
  std::string rows;
  for (int column = 0; column < 4; ++column) {
    const Eigen::Vector4d x = matrix.col(column);
    rows += fmt::format("{}({}, {}, {}, {})", column == 0 ? "" : ", ", x[0], x[1], x[2], x[3]);
  }
  return fmt::format("( {} )", rows);
}

/// Shows the whole of a ball about `center`. Scene coordinates, Y up.
std::string camera(const Eigen::Vector3d& center, double radius) {
  const double distance = radius / std::sin(std::atan(kFilmHeight / 2 / kFocalLength));
  const double azimuth = radians(kAzimuth), elevation = radians(kElevation);
  const Eigen::Vector3d back(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                             std::cos(elevation) * std::cos(azimuth));
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(back).normalized();
  Eigen::Matrix4d placed = Eigen::Matrix4d::Identity();
  placed.col(0).head<3>() = right;
  placed.col(1).head<3>() = back.cross(right);
  placed.col(2).head<3>() = back;
  placed.col(3).head<3>() = center + distance * back;
  return fmt::format(
      "\ndef Camera \"camera\"\n{{\n"
      "    float2 clippingRange = ({}, {})\n"
      "    float focalLength = {}\n    float horizontalAperture = {}\n"
      "    float verticalAperture = {}\n    token projection = \"perspective\"\n"
      "    matrix4d xformOp:transform = {}\n"
      "    uniform token[] xformOpOrder = [\"xformOp:transform\"]\n}}\n",
      distance / 100, 4 * distance, kFocalLength, kFilmWidth, kFilmHeight, usd_matrix(placed));
}

/// A material that reads the colours of vertices.
std::string usd_material(const std::string& path) {
  return fmt::format(
      "\n    def Material \"vertex_colours\"\n    {{\n"
      "        token outputs:surface.connect = <{0}/vertex_colours/surface.outputs:surface>\n\n"
      "        def Shader \"surface\"\n        {{\n"
      "            uniform token info:id = \"UsdPreviewSurface\"\n"
      "            color3f inputs:diffuseColor.connect = "
      "<{0}/vertex_colours/colours.outputs:result>\n"
      "            float inputs:metallic = 0\n            float inputs:roughness = 0.7\n"
      "            token outputs:surface\n        }}\n\n"
      "        def Shader \"colours\"\n        {{\n"
      "            uniform token info:id = \"UsdPrimvarReader_float3\"\n"
      "            string inputs:varname = \"displayColor\"\n"
      "            float3 outputs:result\n        }}\n    }}\n",
      path);
}

/// The list's text, without brackets.
template <class Items, class Print>
void print_list(RecordStream& file, const Items& items, const Print& print) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0) file.print("{}", i % 8 == 0 ? ",\n" : ", ");
    print(items[i]);
  }
}

void print_mesh(RecordStream& file, const TriangleMesh& mesh, const std::string& name,
                const std::string& path) {
  const auto print_vector = [&](const Eigen::Vector3f& x) {
    file.print("({}, {}, {})", x.x(), x.y(), x.z());
  };
  const bool has_colors = !mesh.colors.empty();
  file.print("\n    def Mesh \"{}\"{}\n    {{\n", name,
             has_colors ? " (\n        prepend apiSchemas = [\"MaterialBindingAPI\"]\n    )" : "");
  const Box box = mesh.box();
  file.print("        float3[] extent = [");
  print_vector(box.low.cast<float>());
  file.print(", ");
  print_vector(box.high.cast<float>());
  file.print("]\n        int[] faceVertexCounts = [");
  print_list(file, mesh.triangles, [&](const Triangle&) { file.print("3"); });
  file.print("]\n        int[] faceVertexIndices = [");
  print_list(file, mesh.triangles,
             [&](const Triangle& t) { file.print("{}, {}, {}", t[0], t[1], t[2]); });
  file.print("]\n");
  if (has_colors) file.print("        rel material:binding = <{}/vertex_colours>\n", path);
  file.print("        point3f[] points = [");
  print_list(file, mesh.vertices, [&](const Eigen::Vector3d& x) { print_vector(x.cast<float>()); });
  file.print("]\n");
  if (!mesh.normals.empty()) {
    file.print("        normal3f[] normals = [");
    print_list(file, mesh.normals, print_vector);
    file.print("] (\n            interpolation = \"vertex\"\n        )\n");
  }
  if (has_colors) {
    file.print("        color3f[] primvars:displayColor = [");
    print_list(file, mesh.colors, [&](const VertexColor& color) {
      const auto linear = [&](std::size_t i) { return base::srgb_decoded(color[i] / 255.0); };
      file.print("({:.5g}, {:.5g}, {:.5g})", linear(0), linear(1), linear(2));
    });
    file.print("] (\n            interpolation = \"vertex\"\n        )\n");
  }
  file.print("        uniform token subdivisionScheme = \"none\"\n    }}\n");
}

}  // namespace

namespace {

std::string turned_prim(const std::string& name) {
  const std::string prim = prim_name(name);
  return prim == "camera" ? prim + "_model" : prim;
}

/// All before what stands in the model. @param times more lines of the layer's metadata
void begin_usd(RecordStream& file, const std::string& model, const std::string& note, double metres,
               const Eigen::Matrix4d& turn, const std::string& times) {
  file.print("#usda 1.0\n(\n    defaultPrim = \"{}\"\n", model);
  if (!note.empty()) file.print("    doc = {}\n", quoted(note));
  file.print("{}    metersPerUnit = {}\n    upAxis = \"Y\"\n)\n\n", times, metres);
  file.print(
      "def Xform \"{}\" (\n    kind = \"component\"\n)\n{{\n"
      "    matrix4d xformOp:transform = {}\n"
      "    uniform token[] xformOpOrder = [\"xformOp:transform\"]\n",
      model, usd_matrix(turn));
}

Eigen::Matrix4d upright(UpAxis up) {
  Eigen::Matrix4d turn = Eigen::Matrix4d::Identity();
  turn.topLeftCorner<3, 3>() = quarter_turns(up, UpAxis::y);
  return turn;
}

std::string matrix_of(const BodyPose& pose) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix.topLeftCorner<3, 3>() = pose.turn.toRotationMatrix();
  matrix.topRightCorner<3, 1>() = pose.place;
  return usd_matrix(matrix);
}

}  // namespace

void write_usd(const TriangleMesh& mesh, const std::string& name, const std::string& note,
               UpAxis up, double metres, std::ostream& out) {
  RecordStream file(out);
  const std::string model = turned_prim(name);
  const Eigen::Matrix4d turn = upright(up);
  begin_usd(file, model, note, metres, turn, "");
  // The material beside the mesh has this name, too.
  const std::string prim = prim_name(name);
  const bool is_taken = !mesh.colors.empty() && prim == "vertex_colours";
  print_mesh(file, mesh, is_taken ? prim + "_mesh" : prim, "/" + model);
  if (!mesh.colors.empty()) file.print("{}", usd_material("/" + model));
  file.print("}}\n");
  const Box box = mesh.box();
  file.print("{}", camera(turn.topLeftCorner<3, 3>() * box.center(), box.size().norm() / 2));
}

void write_moving_usd(const MovingMesh& moving, const std::string& name, const std::string& note,
                      UpAxis up, double metres, std::ostream& out) {
  RecordStream file(out);
  const std::string model = turned_prim(name);
  const Eigen::Matrix4d turn = upright(up);
  begin_usd(
      file, model, note, metres, turn,
      fmt::format("    startTimeCode = 0\n    endTimeCode = {}\n    timeCodesPerSecond = {}\n",
                  moving.moments - 1, moving.rate));
  bool has_colors = false;
  for (std::size_t i = 0; i < moving.bodies.size(); ++i) {
    const auto& [mesh, poses] = moving.bodies[i];
    has_colors = has_colors || !mesh.colors.empty();
    file.print("\n    def Xform \"body_{:04}\"\n    {{\n", i);
    if (poses.size() == 1) {
      file.print("    matrix4d xformOp:transform = {}\n", matrix_of(poses.front()));
    } else {
      file.print("    matrix4d xformOp:transform.timeSamples = {{\n");
      for (std::size_t moment = 0; moment < poses.size(); ++moment) {
        file.print("        {}: {},\n", moment, matrix_of(poses[moment]));
      }
      file.print("    }}\n");
    }
    file.print("    uniform token[] xformOpOrder = [\"xformOp:transform\"]\n");
    print_mesh(file, mesh, "mesh", "/" + model);
    file.print("    }}\n");
  }
  if (has_colors) file.print("{}", usd_material("/" + model));
  file.print("}}\n");
  const Box box = mesh_at(moving, 0).box();
  file.print("{}", camera(turn.topLeftCorner<3, 3>() * box.center(), box.size().norm() / 2));
}

MeshFormat usda_format() {
  return {.write =
              [](const TriangleMesh& mesh, const MeshWriting& how, std::ostream& out) {
                write_usd(mesh, how.name, how.options.note, how.up(),
                          how.options.metres_per_unit.value_or(1), out);
              },
          .up = UpAxis::y,
          .has_colors = true};
}

}  // namespace qjulia::shape
