// Texts, bytes and files that hold something else, and places that cannot be written.

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/file_types.hpp"
#include "hostile.hpp"
#include "original/original_file.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using namespace qjulia::test;

TEST_CASE("files that hold something else are refused") {
  const TemporaryFolder folder;
  const std::string garbage("\0\xff{[<ply", 8);
  for (const char* extension : {".obj", ".ply", ".stl", ".off", ".o3d", ".f3d", ".poly4d", ".txt",
                                ".json", ".png", ".glb", ".npz"}) {
    const auto path = folder.file("garbage" + std::string(extension), garbage);
    for (const auto& file :
         {path, folder.path(), folder.path() / "missing", std::filesystem::path()}) {
      CAPTURE(file);
      refuses("read_mesh", [&] { read_mesh(file); });
      refuses("read_and_inspect_mesh", [&] { read_and_inspect_mesh(file); });
      refuses("read_painted_mesh", [&] { read_painted_mesh(file, "a\xff"); });
      CHECK(is_point_cache(file) == (base::extension_of(file) == ".npz"));
      refuses("count_frames", [&] { count_frames(file); });
      refuses("read_frame", [&] { read_frame(file, 0); });
      refuses("read_and_inspect_frame", [&] { read_and_inspect_frame(file, 0); });
      refuses("read_map", [&] { read_map(file); });
      refuses("read_original", [&] { original::read_original(file); });
      refuses("read_sampled_distance", [&] { original::read_sampled_distance(file); });
      refuses("read_portal_text", [&] { original::read_portal_text(file, {}); });
      const std::string type = base::extension_of(file);
      CHECK(type == (file == path ? extension : ""));
      const bool is_mesh = base::content_of(file) == base::FileContent::mesh;
      CHECK((!format_up(file) || is_mesh));
      CHECK((!holds_colors(file) || is_mesh));
      const auto maps = base::extensions(base::FileContent::map, base::FileUse::read);
      CHECK(base::has_type(file, base::FileContent::map, base::FileUse::read) ==
            (std::ranges::find(maps, type) != maps.end()));
      // A picture and a scene may hold a map, so that they are read.
      takes(type != ".png" && type != ".glb", "holds_map", "cannot read",
            [&] { return !holds_map(file) || type == ".json"; });
      takes(type == ".png", "expect_type", "its name must end in .png",
            [&] { base::expect_type(file, base::FileContent::picture, base::FileUse::write); });
    }
  }
}

TEST_CASE("texts that say something else are refused") {
  for (const std::string& text : kHostileTexts) {
    CAPTURE(text);
    const auto refused = [](const char* function, const auto& call) { refuses(function, call); };
    refused("original_from_bytes", [&] { original::original_from_bytes(text, "a text"); });
    refused("polynomial_from_bytes", [&] { original::polynomial_from_bytes(text, "a text"); });
    refused("sampled_distance_from_bytes",
            [&] { original::sampled_distance_from_bytes(text, "a text"); });
    refused("portals_from_text", [&] { original::portals_from_text(text, "a text", {}); });
    refused("schedule_text", [&] { schedule_text(text); });
    refused("knob_named", [&] { knob_named(text); });
    refused("picture_setting_named", [&] { picture_setting_named(text); });
    refused("fit_setting_named", [&] { fit_setting_named(text); });
    refused("setting_named", [&] { setting_named(print_settings(), text, "prints"); });
    const Setting& words = exact_settings().back();
    refused("index_of", [&] { words.index_of(text); });
    int width = 1, height = 2;
    const SizePlace size{&width, &height};
    refused("SizePlace", [&] { size.read(text); });
    CHECK((width == 1 && height == 2));
    refused("light_color_from", [&] { light_color_from(text); });
    refused("lamp_from", [&] { lamp_from(text); });
    takes(text.empty(), "cuts_from", "", [&] { return cuts_from(text).empty(); });
    refused("range_from", [&] { range_from(text); });
    refused("background_from", [&] { background_from(text); });
    refused("palette_from", [&] { palette_from(std::span(&text, 1), Material::trap); });
    refused("look_description", [&] { look_description(text); });
    PictureOptions options;
    refused("apply_look", [&] { apply_look(options, text); });
    refused("apply_built_in_look", [&] { apply_built_in_look(options, text); });
    CHECK_FALSE(color_named(text));
    CHECK_FALSE(palette_named(text));
    CHECK_FALSE(up_axis_named(text));
    CHECK_FALSE(detail_word_named(text));
    bool flag = false;
    CHECK(option_of({.name = text, .example = "", .help = ""}, &flag).ends_with(text));
    accepts("rig_named", [&] { rig_named(static_cast<RigName>(text.size() + 99)); });
  }
  refuses("range_of", "give LOW,HIGH", [] { range_of({}); });
  for (const RigName rig : {RigName::studio, RigName::rim, RigName::low_key, RigName::noon,
                            RigName::dusk, RigName::museum}) {
    CHECK_FALSE(rig_named(rig).lamps.empty());
  }
  for (const base::FileUse use : {base::FileUse::read, base::FileUse::write}) {
    CHECK_FALSE(base::extension_list(base::FileContent::map, use).empty());
  }
}

TEST_CASE("values of JSON that are something else are refused") {
  using nlohmann::json;
  for (const json& value :
       {json(), json(1), json("x"), json::array(), json::object(), json{{"format", "qjulia-map"}},
        json{{"format", 1}, {"version", "x"}, {"kind", json::array()}}}) {
    refuses("map_from_json", [&] { map_from_json(value, "a value"); });
    refuses("tuning_from", [&] { tuning_from(value); });
    refuses("regressions", [&] { regressions({}, value, 0.1); });
  }
  const TemporaryFolder folder;
  accepts("provenance", [&] {
    Map map = good_map();
    map.provenance = json{{"name", "a\xff"}};
    map.provenance.set("\xff", "\xff");
    write_map(map, folder.path() / "map.qjulia.json");
    return read_map(folder.path() / "map.qjulia.json").dynamics.kind() == map.dynamics.kind();
  });
  refuses("provenance", "provenance", [&] {
    Map map = good_map();
    map.provenance = Provenance(json(7));
    map.provenance.set("key", 1);
    map.validate();
  });
}

TEST_CASE("places that cannot be written are named") {
  const TemporaryFolder folder;
  const auto nowhere = folder.path() / "no" / "such";
  const auto names_it = [](const char* function, const auto& call) {
    INFO(function);
    CHECK_THROWS_AS(call(), OutputError);
    CHECK_THROWS_WITH(call(), Catch::Matchers::ContainsSubstring("no/such/") &&
                                  Catch::Matchers::ContainsSubstring("cannot be created"));
  };
  const TriangleMesh box = shapes::box();
  const Image pixel{.width = 1, .height = 1, .pixels = {1, 2, 3}};
  names_it("write_map", [&] { write_map(good_map(), nowhere / "map.qjulia.json"); });
  names_it("write_mesh", [&] { write_mesh(box, nowhere / "mesh.ply"); });
  names_it("PlyFile", [&] { PlyFile(nowhere / "mesh.ply").commit(); });
  names_it("write_png", [&] { write_png(pixel, nowhere / "picture.png"); });
  names_it("write_layers", [&] {
    write_layers({{1}, {0, 0, 1}, {0, 0, 0}}, 1, nowhere / "layers");
  });
  names_it("export_tuning", [&] { export_tuning(shared_device(), nowhere / "tuning.json"); });
  names_it("Trace", [&] {
    Trace trace(Trace::Clock::time_point::max());
    trace.add("\xff", Trace::Row::host, Trace::Timer::wall, Trace::Clock::time_point::min(), {});
    trace.add_launch("\xff", Trace::Row::second_queue, Trace::Timer::device, {}, {},
                     {.slots = std::nan(""), .bytes = -1});
    trace.add_memory(Trace::Row::third_queue, {}, std::numeric_limits<std::size_t>::max());
    { const TraceStage stage(nullptr, ""); }
    trace.write(nowhere / "trace.json", "\xff", {{"\xff", std::nan("")}});
  });
  CHECK(folder.names().empty());
}
