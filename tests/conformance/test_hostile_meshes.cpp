// Meshes that nobody should give, to every public function that takes one: a broken one is refused,
// an odd one gives a result or is refused by what the function needs.

#include <Eigen/Geometry>
#include <filesystem>
#include <set>

#include "base/file_types.hpp"
#include "hostile.hpp"
#include "qjulia/mesh/moving_mesh.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using namespace qjulia::test;

namespace {

const Device& mesh_device() { return test::shared_device(); }

struct NamedMesh {
  std::string name;
  TriangleMesh mesh;
};

/// Meshes that every function refuses.
std::vector<NamedMesh> broken_meshes() {
  const auto with = [](const auto& change) { return changed(shapes::sphere(1), change); };
  return {{"an index beyond", with([](auto& m) { m.triangles[3][1] = 42; })},
          {"the largest index", with([](auto& m) {
             m.triangles.back() = {0, 1, ~0U};
           })},
          {"no vertices", with([](auto& m) { m.vertices.clear(); })},
          {"not a number", with([](auto& m) { m.vertices[7].y() = kNan; })},
          {"infinite", with([](auto& m) { m.vertices[0].x() = -kInfinity; })},
          {"an unused vertex", with([](auto& m) { m.vertices.emplace_back(kNowhere); })},
          {"few normals", with([](auto& m) { m.normals.resize(1); })},
          {"many normals", with([](auto& m) { m.normals.assign(99, Eigen::Vector3f::UnitX()); })},
          {"few colours", with([](auto& m) { m.colors.resize(1); })},
          {"bad normals", with([](auto& m) {
             m.normals.assign(m.vertices.size(), Eigen::Vector3f::Constant(NAN));
           })}};
}

/// What functions need of a mesh. None of the odd ones encloses a volume that can be fitted, has
/// walls, or has the origin inside.
enum class Need {
  nothing,
  floats,    ///< positions that single precision holds, relative to the first
  extent,    ///< a box with finite sides, not all zero, with triangles in it
  inside,    ///< a point that lies inside, by winding numbers
  area,      ///< an area that doubles hold, and is not 0
  nearby,    ///< an area, at coordinates that kernels take
  drawn,     ///< a longest side that can be drawn
  manifold,  ///< no triangle has a vertex twice
  kept,      ///< something where x < 0.1
  volume,    ///< a volume of a size that can be fitted, or printed
};

/// Words of the message for a mesh that has not got it.
std::string words_of(Need need) {
  switch (need) {
    case Need::floats:
      return "is not finite, or too far away";
    case Need::extent:
      return "the mesh has no extent";
    case Need::manifold:
      return "has a vertex twice";
    case Need::kept:
      return "cut";
    default:
      return "";  // several checks, of which the first that fails speaks
  }
}

struct OddMesh : NamedMesh {
  std::set<Need> met;
};

/// Meshes that hold nothing, or too much of it.
std::vector<OddMesh> odd_meshes() {
  using enum Need;
  const auto scaled = [](double size) {
    return shapes::moved(shapes::sphere(1), size, Eigen::Vector3d::Zero());
  };
  const auto odd = [](const char* name, TriangleMesh mesh, std::set<Need> met) {
    met.insert(nothing);
    return OddMesh{{name, std::move(mesh)}, std::move(met)};
  };
  return {odd("empty", {}, {floats, manifold, kept}),
          odd("no triangles", {shapes::sphere(1).vertices, {}}, {floats, manifold, kept, drawn}),
          odd("a point", {{{1, 2, 3}}, {{0, 0, 0}}}, {floats}),
          odd("one triangle", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}},
              {floats, extent, area, nearby, drawn, manifold, kept}),
          odd("a line", {{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}, {2, 1, 0}}},
              {floats, extent, inside, drawn, manifold, kept}),
          odd("the same corner", {shapes::sphere(1).vertices, {{5, 5, 5}, {5, 5, 6}}},
              {floats, extent, drawn, kept}),
          odd("both windings", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}},
              {floats, extent, area, nearby, drawn, manifold, kept}),
          odd("huge", scaled(1e300), {extent, manifold, kept}),
          odd("tiny", scaled(1e-300), {floats, extent, inside, manifold, kept}),
          odd("far away", shapes::moved(shapes::sphere(1), 1, {1e300, 0, 0}),
              {floats, extent, area, manifold}),
          odd("huge box", {{{-1.7e308, 0, 0}, {1.7e308, 0, 0}, {0, 1.7e308, 0}}, {{0, 1, 2}}},
              {manifold, kept})};
}

/// Calls `use` with a name, what it needs and a call for each public function that takes a mesh.
template <class Use>
void for_mesh_functions(const TriangleMesh& mesh, const std::filesystem::path& folder,
                        const Use& use) {
  const std::size_t triangles = mesh.triangles.size();
  use("validate", Need::nothing, [&] { mesh.validate(); });
  use("inspect", Need::nothing, [&] {
    const MeshReport report = inspect(mesh);
    CHECK(report.triangles == triangles);
    CHECK(report.vertices == mesh.vertices.size());
    CHECK((report.closed() || !report.warnings().empty()));
  });
  use("signed_volume", Need::nothing, [&] { signed_volume(mesh); });
  use("oriented_outward", Need::nothing,
      [&] { return oriented_outward(mesh).triangles.size() == triangles; });
  use("scattered", Need::nothing, [&] {
    const MovingMesh moving = scattered(mesh, {.seconds = 0.5});
    moving.validate();
    CHECK(mesh_at(moving, 1).triangles.size() <= triangles);
    CHECK(mesh_after(moving, 0.3).triangles.size() <= triangles);
    write_moving_mesh(moving, folder / "moving.glb", {});
  });
  use("guess_up", Need::nothing, [&] { return axis_number(guess_up(mesh)) <= 2; });
  use("as_if_read", Need::nearby, [&] {
    const InspectedMesh read = as_if_read(mesh);
    read.mesh.validate();
    CHECK_FALSE(read.mesh.triangles.empty());
  });
  use("radial_spread", Need::volume, [&] { radial_spread(mesh, Eigen::Vector3d::Zero()); });
  for (const std::string& type : base::extensions(base::FileContent::mesh, base::FileUse::write)) {
    const std::filesystem::path path = folder / ("m" + type);
    const auto is_written = [&] { return std::filesystem::file_size(path) > 0; };
    use("write_mesh", Need::nothing, [&] {
      write_mesh(mesh, path, "a\xff note", UpAxis::x);
      CHECK(is_written());
      std::filesystem::remove(path);
    });
    use("MeshFileOptions", Need::nothing, [&] {
      const MeshFileOptions options{
          .file_up = UpAxis::minus_x, .name = "a\n\xff", .metres_per_unit = 1e300};
      CHECK(options.file_turn().determinant() == Catch::Approx(1));
      write_mesh(mesh, path, options);
      CHECK(is_written());
      std::filesystem::remove(path);
    });
  }
  use("measure", Need::floats, [&] {
    const SurfaceFigures figures = measure(mesh);
    CHECK(figures.triangles == triangles);
    CHECK(figures.area >= 0);
    CHECK(to_json(figures).at("area") == figures.area);
  });
  use("FigureSink", Need::floats, [&] {
    FigureSink sink(mesh);
    CHECK(sink.drop_loose_pieces().count == 0);
  });
  use("kept_of", Need::nothing, [&] { return FigureSink().kept_of(mesh).triangles.empty(); });
  use("large_components", Need::floats,
      [&] { return large_components(mesh, 0.5).triangles.size() <= triangles; });
  use("select_parts", Need::floats, [&] {
    TriangleMesh copy = mesh;
    select_parts(copy, {.min_component = 0.5});
    copy.validate();
  });
  use("drop_loose_pieces", Need::floats, [&] {
    TriangleMesh copy = mesh;
    const LoosePieces dropped = drop_loose_pieces(copy);
    copy.validate();
    return dropped.count == 0;
  });
  use("cut_open", Need::kept, [&] {
    const TriangleMesh open = cut_open(mesh, {.cuts = {{'x', 0.1}}}, std::nullopt);
    for (const Triangle& triangle : open.triangles) {
      for (const std::uint32_t corner : triangle) CHECK(open.vertices[corner].x() <= 0.1 + 1e-9);
    }
  });
  use("cut_away", Need::nothing, [&] {
    for (const double at : {0.0, 1e300, -1e300}) {
      const TriangleMesh rest = cut_away(mesh, {'y', at}, std::nullopt);
      for (const Triangle& triangle : rest.triangles) {
        for (const std::uint32_t corner : triangle) CHECK(rest.vertices[corner].y() <= at);
      }
    }
    cut_away(mesh, {'z', 50, true}, Box{{0, 0, -1e300}, {1, 1, 1e300}}).validate();
  });
  use("decimated", Need::nothing,
      [&] { return decimated(mesh, 4).triangles.size() <= std::max<std::size_t>(triangles, 4); });
  use("decimate", Need::manifold, [&] {
    const Decimation less = decimate(mesh, {std::nullopt, 0.1});
    CHECK(less.report.before == triangles);
    CHECK(less.report.after == less.mesh.triangles.size());
  });
  use("made_printable", Need::volume,
      [&] { made_printable(mesh, {.height = 2, .min_wall = 1, .flat_foot = 0.1}); });
  use("made_printable, hollow", Need::volume,
      [&] { made_printable(mesh, {.longest = 2, .shell = 0.5, .drain = 0.3}); });
  use("sample_surface", Need::area, [&] {
    for (const SurfacePoint& point : sample_surface(mesh, 10, 1)) {
      CHECK(point.position.allFinite());
      CHECK(point.normal.norm() == Catch::Approx(1));
    }
  });
  use("SignedDistance", Need::extent, [&] {
    const SignedDistance distance(mesh_device(), mesh);
    const std::vector<Eigen::Vector3d> points{{0, 0, 0}, {kHuge, 0, 0}};
    CHECK(distance.at(points).size() == 2);
    CHECK(distance.winding_numbers(points).size() == 2);
  });
  use("deepest_interior_point", Need::inside, [&] {
    const auto deepest = deepest_interior_point(SignedDistance(mesh_device(), mesh), mesh.box());
    CHECK(deepest.position.allFinite());
    CHECK(deepest.inradius > 0);
  });
  use("outer_surface", Need::area,
      [&] { return !outer_surface(mesh_device(), mesh).mesh.triangles.empty(); });
  use("make_shape", Need::volume, [&] { make_shape(mesh_device(), mesh); });
  use("wall_thickness", Need::area, [&] {
    const WallThickness walls = wall_thickness(mesh);
    CHECK_FALSE(walls.thinnest > walls.tenth);
    CHECK_FALSE(walls.tenth > walls.median);
  });
  const Map map = good_map();
  use("compare", Need::nearby, [&] {
    const auto metrics = compare(mesh_device(), map, mesh, small_compare());
    REQUIRE(metrics.size() == 1);
    CHECK_FALSE(metrics[0].iou > 0.5);
  });
  use("fit", Need::volume, [&] { fit(mesh_device(), mesh, small_fit()); });
  use("Fit", Need::volume, [&] {
    FitOptions weighted = small_fit();
    weighted.weights = [](auto points) { return std::vector<double>(points.size(), 1); };
    Fit(mesh_device(), mesh, weighted).step();
  });
  use("fit from a map", Need::volume, [&] {
    FitOptions started = small_fit();
    started.initial = good_map();
    started.schedule_text = schedule_text("fast");
    fit(mesh_device(), mesh, started);
  });
  use("exact_map", Need::volume, [&] { exact_map(mesh_device(), mesh, small_exact()); });
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  use("Studio", Need::drawn, [&] {
    Studio studio(mesh_device(), mesh, box, small_picture());
    check_picture(studio.picture({}), small_picture());
  });
  use("render_mesh", Need::drawn, [&] {
    check_picture(render_mesh(mesh_device(), mesh, box, small_picture()), small_picture());
  });
  use("comparison", Need::nearby, [&] {
    const Image image = comparison(mesh_device(), map, mesh, small_picture());
    image.validate();
    CHECK(image.width > 8);
  });
  use("surface_colors", Need::nothing, [&] {
    return surface_colors(mesh_device(), map, mesh, {.iterations = 2}).colors.size() ==
           mesh.vertices.size();
  });
}

}  // namespace

TEST_CASE("meshes that are broken are refused by all that take one") {
  const TemporaryFolder folder;
  for (const NamedMesh& broken : broken_meshes()) {
    CAPTURE(broken.name);
    for_mesh_functions(
        broken.mesh, folder.path(),
        [](const char* function, Need /*need*/, const auto& call) { refuses(function, call); });
  }
  CHECK(folder.names().empty());
  TriangleMesh mesh = shapes::sphere(1);
  mesh.vertices[7].y() = kNan;
  CHECK_THROWS_WITH(mesh.validate(), Catch::Matchers::ContainsSubstring("vertices[7]"));
}

TEST_CASE("every function that takes a mesh names the triangle whose index is out of range") {
  const TemporaryFolder folder;
  TriangleMesh mesh = shapes::sphere(1);
  mesh.triangles[3][1] = 42;
  const auto names_it = [](const char* function, const auto& call) {
    refuses(function, "triangles[3]", call);
    refuses(function, "42", call);
  };
  for_mesh_functions(
      mesh, folder.path(),
      [&](const char* function, Need /*need*/, const auto& call) { names_it(function, call); });
  PaintOptions painting;
  painting.mesh =
      PaintedMesh{mesh.vertices, mesh.triangles, std::vector<float>(mesh.vertices.size(), 0.5F)};
  names_it("painted", [&] { painted(mesh_device(), good_map(), painting); });
}

TEST_CASE("meshes that hold nothing or are beyond all measure give what they can", "[slow]") {
  const TemporaryFolder folder;
  for (const OddMesh& odd : odd_meshes()) {
    CAPTURE(odd.name);
    for_mesh_functions(odd.mesh, folder.path(),
                       [&](const char* function, Need need, const auto& call) {
                         takes(odd.met.contains(need), function, words_of(need), call);
                       });
  }
}

TEST_CASE("hostile numbers for meshes are refused by name, or measure nothing") {
  const TriangleMesh mesh = shapes::sphere(1);
  const auto may_be_dimension = [](const BoxDimension& found) {
    return std::isnan(found.dimension) || is_within(found.dimension, 0, 3);
  };
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const Eigen::Vector3d v(x, 0, 0);
    const bool is_small = std::abs(x) <= 1;  // the sphere's radius is 1
    takes(is_small && x >= 0, "radial_spread", "the origin is not inside",
          [&] { return radial_spread(mesh, v).of_log_radii >= 0; });
    takes(is_near(x) && x != 0 && std::abs(x) > 1e-150, "sample_surface", "the mesh", [&] {
      for (const SurfacePoint& point : sample_surface(shapes::moved(mesh, x, v), 3, 1)) {
        CHECK((point.position - v).norm() <= 1.001);
      }
    });
    accepts("large_components", [&] {
      // What is not a number or negative drops nothing; the largest part is never dropped.
      CHECK(large_components(mesh, x).triangles.size() == mesh.triangles.size());
    });
    const auto f = static_cast<float>(x);
    takes(std::isfinite(f), "box_dimension", "is not finite", [&] {
      const std::vector<Eigen::Vector3f> points{{f, 0, 0}, {0, f, 1}};
      return may_be_dimension(box_dimension(points, 0.01));
    });
    accepts("box_dimension, finest", [&] {
      const std::vector<Eigen::Vector3f> points{{0, 0, 0}, {0, 1, 1}};
      return may_be_dimension(box_dimension(points, x));
    });
    accepts("frame", [&] {
      const ShapeToMap frame{x, v};
      CHECK((frame.to_map(Eigen::Vector3d::Zero()) - v).isZero() == std::isfinite(x));
      CHECK(frame.to_map(Box{v, v}).size().isZero() == is_within(x, -1, 1));
      CHECK(frame.to_shape(v).allFinite() == (std::isfinite(x) && x != 0));
    });
    takes(is_within(x, 1e-6, 1e9), "print", "height",
          [&] { PrintOptions{.height = x}.validate(); });
  }
  accepts("box_dimension", [] { return box_dimension({}, 0.1).sizes == 0; });
  refuses("decimated", "most", [&] { decimated(mesh, 3); });
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  for (const Cut& cut : {Cut{'y', kNan}, {'z', kInfinity, true}, {'?', 0}, {'\xff', 50, true}}) {
    refuses("place_of", "cut", [&] { place_of(cut, box); });
    refuses("cut_away", "cut", [&] { cut_away(mesh, cut, box); });
    refuses("cut_open", "cut", [&] { cut_open(mesh, {.cuts = {cut}}, box); });
    refuses("Selection", "cut", [&] { Selection{.cuts = {cut}}.validate(); });
  }
  refuses("place_of", "cut", [] { place_of({'x', 50, true}, std::nullopt); });
  for (const UpAxis axis : {UpAxis::x, UpAxis::y, UpAxis::z, UpAxis::minus_x}) {
    CHECK((quarter_turns(axis, UpAxis::z) * direction(axis) - direction(UpAxis::z)).isZero(1e-12));
    CHECK(std::abs(direction(axis)[axis_number(axis)]) == 1);
  }
}

TEST_CASE("textures that are broken are refused") {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "textured.glb";
  TriangleMesh mesh = shapes::sphere(1);
  const Map map = good_map();
  const auto bake = [&](const TriangleMesh& on, int size) {
    return bake_texture(mesh_device(), map, on, on, {.size = size});
  };
  refuses("bake_texture", "needs meshes with triangles and with normals", [&] { bake(mesh, 256); });
  mesh.normals.assign(mesh.vertices.size(), Eigen::Vector3f::UnitZ());
  for (const int size : {-1, 0, 63, 8193, std::numeric_limits<int>::max()}) {
    refuses("bake_texture", "size", [&] { bake(mesh, size); });
    refuses("validate", "size", [&] { TextureOptions{.size = size}.validate(); });
  }
  for (const OddMesh& odd : odd_meshes()) {
    INFO(odd.name);
    TriangleMesh with_normals = odd.mesh;
    with_normals.normals.assign(odd.mesh.vertices.size(), Eigen::Vector3f::UnitZ());
    survives("bake_texture", "a mesh may have no triangle, and may be refused",
             [&] { bake(with_normals, 256).validate(with_normals); });
  }
  const auto with_colors = [&](const auto& change) {
    SurfaceColorOptions colors;
    return bake_texture(mesh_device(), map, mesh, mesh,
                        {.size = 256, .colors = changed(colors, change)});
  };
  accepts("bake_texture", [&] { return !with_colors([](auto&) {}).color.empty(); });
  refuses("bake_texture", "material",
          [&] { with_colors([](SurfaceColorOptions& c) { c.material = Material::clay; }); });
  refuses("bake_texture", "range", [&] {
    with_colors([](SurfaceColorOptions& c) { c.range = MaterialRange{std::nan(""), 1}; });
  });
  refuses("expect_texture_size", "size", [&] { expect_texture_size(64, 129); });
  accepts("expect_texture_size", [&] { expect_texture_size(64, 128); });
  refuses("expect_texture_size", "size", [&] { expect_texture_size(0, ~std::size_t{0} / 2); });
  for (const char* name : {"a.ply", "", ".glb", "a.glb.png"}) CHECK_FALSE(holds_textures(name));
  const MeshTexture texture = bake(mesh, 256);
  accepts("write_textured_mesh", [&] {
    write_textured_mesh(mesh, texture, path);
    return std::filesystem::file_size(path) > texture.normal.size();
  });
  const auto refused = [&](const char* named, const auto& change) {
    const MeshTexture broken = changed(texture, change);
    refuses("validate", named, [&] { broken.validate(mesh); });
    refuses("write_textured_mesh", named, [&] { write_textured_mesh(mesh, broken, path); });
  };
  refused("three for each", [](MeshTexture& t) { t.places.pop_back(); });
  refused("one for each", [](MeshTexture& t) { t.tangents.pop_back(); });
  refused("no picture of normals", [](MeshTexture& t) { t.normal.clear(); });
  refused("no .png", [](MeshTexture& t) { t.color = "GIF89a"; });
  for (const float x : {-0.1F, 1.1F, std::numeric_limits<float>::quiet_NaN()}) {
    refused("give 0 to 1", [&](MeshTexture& t) { t.places[1].y() = x; });
  }
  refuses("write_textured_mesh", "written as .glb",
          [&] { write_textured_mesh(mesh, texture, folder / "textured.ply"); });
}
