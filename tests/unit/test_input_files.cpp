/// Reading what users give: kinds of files, limits, encodings, and the table of file types.

#include <sys/stat.h>

#include <catch2/catch_all.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/file_types.hpp"
#include "base/input_file.hpp"
#include "base/text.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

const test::TemporaryFolder scratch;

std::filesystem::path pipe_named(const std::string& name) {
  const auto path = scratch.path() / name;
  REQUIRE(::mkfifo(path.c_str(), 0600) == 0);
  return path;
}

}  // namespace

TEST_CASE("files that are not there, folders and devices are refused") {
  const auto refused = [](const std::filesystem::path& path, const std::string& why) {
    CHECK_THROWS_WITH(
        base::read_text_file(path, "map", 1000),
        ContainsSubstring("cannot read map '" + path.string()) && ContainsSubstring(why));
  };
  refused(scratch.path() / "gone", "no such file");
  refused(scratch.path(), "a folder");
  refused("/dev/zero", "a device");
  refused("/dev/null", "a device");
}

TEST_CASE("the size of a file is limited, and the limit is named") {
  const auto path = scratch.file("long", std::string(2000, 'x'));
  CHECK(base::read_text_file(path, "map", 2000).size() == 2000);
  CHECK_THROWS_WITH(base::read_text_file(path, "map", 1999),
                    ContainsSubstring("1.952 KiB at most"));
  // A file with holes takes no room on the disk.
  const auto huge = scratch.file("huge.obj", "");
  std::filesystem::resize_file(huge, std::uintmax_t{1} << 40);
  CHECK_THROWS_WITH(read_mesh(huge),
                    ContainsSubstring("1 TiB") && ContainsSubstring("16 GiB at most"));
  // Zeros up to the limit are recognised before they are all read.
  std::filesystem::resize_file(huge, std::uintmax_t{15} << 30);
  CHECK_THROWS_WITH(read_mesh(huge), ContainsSubstring("zero bytes"));
}

TEST_CASE("a pipe is read to its end") {
  const auto path = pipe_named("full.obj");
  std::thread writer([&] {
    std::ofstream out(path);
    out << "v 0 0 0\nv 1 0 0\n" << std::flush;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    out << "v 0 1 0\nf 1 2 3\n";
  });
  CHECK(read_mesh(path).triangles.size() == 1);
  writer.join();
}

TEST_CASE("a pipe without end meets the limit") {
  const auto path = pipe_named("endless");
  std::signal(SIGPIPE, SIG_IGN);  // the writer's, when the reader has gone
  std::thread writer([&] {
    std::ofstream out(path);
    while (out << std::string(4096, 'x') << std::flush) {
    }
  });
  CHECK_THROWS_WITH(base::read_text_file(path, "map", 100'000),
                    ContainsSubstring("more than 97.66 KiB"));
  writer.join();
}

TEST_CASE("a stop request ends waiting for a pipe that nobody writes into") {
  const auto path = pipe_named("silent.obj");
  std::stop_source source;
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    source.request_stop();
  });
  const auto start = std::chrono::steady_clock::now();
  CHECK_THROWS_AS(read_mesh(path, source.get_token()), Interrupted);
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(5));
  later.join();
}

TEST_CASE("texts lose a byte order mark, and wide encodings are refused by name") {
  const auto text = [](std::string_view bytes) {
    return base::read_text_file(scratch.file("text", bytes), "manifest", 1000);
  };
  using namespace std::string_view_literals;
  CHECK(text("\xEF\xBB\xBFmesh") == "mesh");
  CHECK(text("mesh") == "mesh");
  CHECK_THROWS_WITH(text("\xFF\xFEm\0"sv), ContainsSubstring("UTF-16"));
  CHECK_THROWS_WITH(text("\xFE\xFF\0m"sv), ContainsSubstring("UTF-16"));
  CHECK_THROWS_WITH(text("\xFF\xFE\0\0m\0\0\0"sv), ContainsSubstring("UTF-32"));
}

TEST_CASE("bytes that are not UTF-8 are written out, and JSON takes the result") {
  CHECK(base::to_utf8("plain h\u00e9 \u4e16 \U0001F600") == "plain h\u00e9 \u4e16 \U0001F600");
  CHECK(base::to_utf8("\xFF") == "\\xFF");
  CHECK(base::to_utf8("h\xC3") == "h\\xC3");                             // cut off
  CHECK(base::to_utf8("\xC0\xAF") == "\\xC0\\xAF");                      // overlong
  CHECK(base::to_utf8("\xED\xA0\x80") == "\\xED\\xA0\\x80");             // a surrogate
  CHECK(base::to_utf8("\xF4\x90\x80\x80x") == "\\xF4\\x90\\x80\\x80x");  // beyond Unicode
  for (int first = 0; first < 256; ++first) {
    for (int second = 0; second < 256; ++second) {
      const std::string bytes = {static_cast<char>(first), static_cast<char>(second)};
      CHECK_NOTHROW(nlohmann::json(base::to_utf8(bytes)).dump());
    }
  }
}

TEST_CASE("brackets of JSON are counted where they are no text") {
  const std::string open(64, '['), closed(64, ']');
  CHECK_FALSE(base::is_json_too_deep(open + closed));
  CHECK_FALSE(base::is_json_too_deep(open + closed + open + closed));
  CHECK(base::is_json_too_deep("{\"a\":" + open + closed + "}"));
  CHECK_FALSE(base::is_json_too_deep(R"(["\"[\\", ")" + open + R"("])"));
  CHECK(base::is_json_too_deep(R"(["\\", )" + open + closed + "]"));
}

TEST_CASE("one table says what a file is by its extension, in any case") {
  CHECK(base::extension_of("a/B.GLB") == ".glb");
  CHECK(base::extension_of("none").empty());
  for (const char* name : {"m.obj", "m.OFF", "m.Ply", "m.STL", "m.GLB"}) {
    CHECK(base::has_type(name, base::FileContent::mesh, base::FileUse::read));
    CHECK(base::has_type(name, base::FileContent::mesh, base::FileUse::write));
  }
  CHECK(base::has_type("m.3MF", base::FileContent::mesh, base::FileUse::read));
  CHECK_FALSE(base::has_type("m.gltf", base::FileContent::mesh, base::FileUse::write));
  CHECK(base::has_type("m.O3D", base::FileContent::original_map, base::FileUse::read));
  CHECK(base::extension_list(base::FileContent::mesh, base::FileUse::read) ==
        ".obj, .off, .ply, .stl, .glb, .gltf or .3mf");
  CHECK(base::extension_list(base::FileContent::field, base::FileUse::write) == ".npy or .vti");
  CHECK(base::expect_type("m.NPY", base::FileContent::field, base::FileUse::write) == ".npy");
  CHECK_THROWS_WITH(base::expect_type("m.gif", base::FileContent::picture, base::FileUse::write),
                    ContainsSubstring("cannot write picture 'm.gif': its name must end in .png"));
}

TEST_CASE("bytes with a special meaning in a web address are percent-encoded") {
  CHECK(base::percent_encoded("1e+20&x=50% #\xC3\xA9") == "1e%2B20%26x%3D50%25%20%23%C3%A9");
  CHECK(base::percent_encoded("aZ09-._~") == "aZ09-._~");
  CHECK(base::percent_encoded("0.1,-2", ",") == "0.1,-2");
}
