// Meshes for printers: .3mf.

#include <catch2/catch_all.hpp>
#include <set>
#include <sstream>

#include "qjulia/base/error.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"
#include "zip_text.hpp"

using namespace qjulia;

namespace {

const test::TemporaryFolder print_folder;

/// The texts between `open` and the next `close`, in order.
std::vector<std::string> pieces(const std::string& text, const std::string& open,
                                const std::string& close) {
  std::vector<std::string> found;
  for (std::size_t at = 0; (at = text.find(open, at)) != std::string::npos;) {
    at += open.size();
    found.push_back(text.substr(at, text.find(close, at) - at));
  }
  return found;
}

/// The number of an attribute.
double attribute(const std::string& tag, const std::string& name) {
  const auto found = pieces(" " + tag, " " + name + "=\"", "\"");
  REQUIRE(found.size() == 1);
  return std::stod(found[0]);
}

struct PrintObject {
  std::string head;
  TriangleMesh mesh;
  std::vector<Triangle> colors;  ///< numbers in the group, by corner
};

struct PrintModel {
  std::string text;
  std::vector<std::string> colors;  ///< as in "#00FF00"
  std::vector<PrintObject> objects;
};

PrintModel written(const TriangleMesh& mesh, const MeshFileOptions& options) {
  const auto path = print_folder.path() / "model.3mf";
  write_mesh(mesh, path, options);
  const auto entries = test::zip_entries(test::read_text(path));
  CHECK(entries.size() == 3);
  CHECK(entries.contains("[Content_Types].xml"));
  CHECK(entries.at("_rels/.rels").find("\"/3D/3dmodel.model\"") != std::string::npos);
  PrintModel model{entries.at("3D/3dmodel.model"), {}, {}};
  model.colors = pieces(model.text, "<m:color color=\"", "\"");
  for (const std::string& text : pieces(model.text, "<object ", "</object>")) {
    PrintObject& object = model.objects.emplace_back();
    object.head = text.substr(0, text.find('>'));
    for (const std::string& tag : pieces(text, "<vertex ", "/>")) {
      object.mesh.vertices.emplace_back(attribute(tag, "x"), attribute(tag, "y"),
                                        attribute(tag, "z"));
    }
    for (const std::string& tag : pieces(text, "<triangle ", "/>")) {
      const auto number = [&](const char* name) {
        return static_cast<std::uint32_t>(attribute(tag, name));
      };
      object.mesh.triangles.push_back({number("v1"), number("v2"), number("v3")});
      if (!model.colors.empty()) {
        object.colors.push_back({number("p1"), number("p2"), number("p3")});
      }
    }
  }
  return model;
}

}  // namespace

TEST_CASE("in a .3mf each body is an object, together with its cavities") {
  const TriangleMesh ball = shapes::sphere(2, 0.5), cavity = shapes::sphere(1),
                     box = shapes::box({-2, -2, -2}, {2, 2, 2});
  // A ball in a box's cavity comes first.
  const TriangleMesh mesh =
      shapes::joined(shapes::joined(ball, shapes::inside_out(cavity)),
                     shapes::joined(box, shapes::box({10, 0, 0}, {11, 1, 1})));
  const PrintModel model = written(mesh, {.name = "a <b>"});
  REQUIRE(model.objects.size() == 3);
  CHECK(model.objects[0].mesh.triangles.size() == ball.triangles.size());
  CHECK(model.objects[1].mesh.triangles.size() == cavity.triangles.size() + box.triangles.size());
  CHECK(model.objects[2].mesh.triangles.size() == box.triangles.size());
  double volume = 0;
  for (const PrintObject& object : model.objects) {
    CHECK(inspect(object.mesh).closed());
    volume += signed_volume(object.mesh);
  }
  CHECK(volume == Catch::Approx(signed_volume(mesh)).epsilon(1e-6));
  CHECK(model.objects[1].head.find("name=\"a &lt;b&gt; 2 of 3\"") != std::string::npos);
  // They keep their places to each other, the lowest on the plate.
  const auto items = pieces(model.text, "<item ", "/>");
  REQUIRE(items.size() == 3);
  for (const std::string& item : items) {
    CHECK(item.find("transform=\"1 0 0 0 1 0 0 0 1 2 2 2\"") != std::string::npos);
  }
}

TEST_CASE("in a .3mf a cavity belongs to the smallest body around it") {
  const auto cube = [](double half) {
    return shapes::box(Eigen::Vector3d::Constant(-half), Eigen::Vector3d::Constant(half));
  };
  const TriangleMesh ball = shapes::sphere(1, 0.5);
  TriangleMesh mesh = shapes::joined(cube(10), cube(2));
  mesh = shapes::joined(mesh, shapes::inside_out(ball));     // within both
  mesh = shapes::joined(mesh, shapes::inside_out(cube(5)));  // within the larger one
  mesh = shapes::joined(mesh, shapes::inside_out(shapes::box({20, 0, 0}, {21, 1, 1})));
  const PrintModel model = written(mesh, {});
  REQUIRE(model.objects.size() == 3);
  const std::size_t box = cube(1).triangles.size();
  CHECK(model.objects[0].mesh.triangles.size() == 2 * box);
  CHECK(model.objects[1].mesh.triangles.size() == box + ball.triangles.size());
  CHECK(model.objects[2].mesh.triangles.size() == box);
}

TEST_CASE("a .3mf is in millimetres and stands on the plate") {
  const TriangleMesh mesh = shapes::box({-1, -2, -3}, {4, 8, 16});
  const Box own = written(mesh, {}).objects.at(0).mesh.box();
  CHECK(own.size().isApprox(Eigen::Vector3d(5, 10, 19)));
  const MeshFileOptions centimetres{.up = UpAxis::y, .metres_per_unit = 0.01};
  const PrintModel turned = written(mesh, centimetres);
  CHECK(turned.text.find("unit=\"millimeter\"") != std::string::npos);
  CHECK(turned.objects.at(0).mesh.box().size().isApprox(Eigen::Vector3d(50, 190, 100)));
  CHECK(turned.objects.at(0).mesh.box().high.z() == Catch::Approx(80));
  CHECK(signed_volume(turned.objects.at(0).mesh) == Catch::Approx(1000 * signed_volume(mesh)));
  CHECK_THROWS_AS(written(mesh, {.metres_per_unit = 0}), OptionError);
}

TEST_CASE("a .3mf has the colour of each corner, and each colour once") {
  TriangleMesh mesh = shapes::sphere(2);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    mesh.colors.push_back({static_cast<std::uint8_t>(v % 7), 200, 188});
  }
  const PrintModel model = written(mesh, {});
  CHECK(model.colors.size() == 7);
  CHECK(std::set(model.colors.begin(), model.colors.end()).contains("#06C8BC"));
  REQUIRE(model.objects.size() == 1);
  CHECK(model.objects[0].head.find("pid=\"1\" pindex=\"0\"") != std::string::npos);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      REQUIRE(model.colors.at(model.objects[0].colors.at(t).at(i)) ==
              "#0" + std::to_string(mesh.triangles[t][i] % 7) + "C8BC");
    }
  }
}

TEST_CASE("the note of a .3mf is text, whatever its bytes are") {
  const PrintModel model = written(shapes::box(), {.note = "{\"a\": \"<\xff&\"}"});
  const auto note = pieces(model.text, "<metadata name=\"Description\">", "</metadata>");
  REQUIRE(note.size() == 1);
  CHECK(note[0] == "{&quot;a&quot;: &quot;&lt;\xEF\xBF\xBD&amp;&quot;}");
}
