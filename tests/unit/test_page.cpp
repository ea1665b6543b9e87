// Pages on which maps are played with: the map in them comes back, and names in them are text.

#include <stdio.h>
#include <unistd.h>

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/base64.hpp"
#include "explore/page.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"
#include "random_maps.hpp"

using namespace qjulia;

namespace {

/// A page as a file that goes away with the test.
class PageFile {
 public:
  explicit PageFile(const std::string& text) { std::ofstream(path, std::ios::binary) << text; }
  ~PageFile() { std::filesystem::remove(path); }
  PageFile(const PageFile&) = delete;
  PageFile& operator=(const PageFile&) = delete;

  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("qjulia_" + std::to_string(::getpid()) + ".html");
};

/// What stands between two texts, from the first on.
std::string between(const std::string& text, const std::string& begin, const std::string& end) {
  const auto from = text.find(begin);
  REQUIRE(from != std::string::npos);
  const auto first = from + begin.size();
  return text.substr(first, text.find(end, first) - first);
}

/// The SHA-256 of a file by another program, in base64.
std::string sha256_of(const std::filesystem::path& path) {
  std::unique_ptr<FILE, int (*)(FILE*)> pipe(
      ::popen(("sha256sum '" + path.string() + "'").c_str(), "r"), ::pclose);
  REQUIRE(pipe);
  std::string digits(64, '\0');
  REQUIRE(std::fread(digits.data(), 1, digits.size(), pipe.get()) == digits.size());
  std::string bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    bytes.push_back(static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  }
  return base::base64(bytes);
}

Map nasty_map() {
  Map map = test::random_map(30, 0.001, 0.6, 5);
  map.provenance = nlohmann::json{{"note", "</script><script>alert(1)</script><!--"}};
  return map;
}

std::string shared(const Map& map, const std::string& file = "ball.qjulia.json") {
  return explore::shared_page(map, file, {"{}", 0}, {});
}

}  // namespace

TEST_CASE("a page gives its map back") {
  const Map map = nasty_map();
  const PageFile page(shared(map));
  CHECK(to_json(read_map(page.path)) == to_json(map));
}

TEST_CASE("a page that was saved with other beginnings is still a page") {
  const Map map = nasty_map();
  const std::string text = shared(map);
  const std::string type = "<!DOCTYPE html>";
  REQUIRE(text.starts_with(type));
  for (const char* begin :
       {"\r\n<!doctype html>", "<!-- saved from url=(0014)about:internet -->\n"}) {
    const PageFile page(begin + text.substr(type.size()));
    CHECK(to_json(read_map(page.path)) == to_json(map));
  }
}

TEST_CASE("a page that an editor or a browser has saved again gives its map back") {
  const Map map = nasty_map();
  const std::string text = shared(map);
  const std::string begin = "<script type=\"application/json\" id=\"qjulia-map\">";
  const std::string json = between(text, begin, "</script>");
  const auto replaced = [](std::string in, const std::string& what, const std::string& by) {
    const auto at = in.find(what);
    REQUIRE(at != std::string::npos);
    return in.replace(at, what.size(), by);
  };
  for (const char* tag :
       {"<script id=\"qjulia-map\" type=\"application/json\">",
        "<script type='application/json' id='qjulia-map'>", "<script id=qjulia-map>",
        "<SCRIPT TYPE=\"application/json\"\n\tID = \"qjulia-map\" >",
        "<script data-note=\"a > b </script>\" id='qjulia-map' async/>"}) {
    for (const char* end : {"</script>", "</SCRIPT>", "</script\n>", "</Script x=1>"}) {
      CAPTURE(tag, end);
      const PageFile page(
          replaced(text, begin + json + "</script>", tag + ("\n" + json) + "\n" + end));
      CHECK(to_json(read_map(page.path)) == to_json(map));
    }
  }
}

TEST_CASE("what only looks like a page's map is passed over") {
  const Map map = nasty_map();
  const std::string text = shared(map);
  const std::string other = "<script type=\"application/json\" id=\"qjulia-map\">{}</script>";
  const std::string head = "<body>";
  const auto at = text.find(head);
  REQUIRE(at != std::string::npos);
  for (const std::string& before : std::vector<std::string>{
           "<!-- " + other + " -->", "<!--><!--->" + ("<!-- --!><!-- > " + other) + "-->",
           "<style>/* " + other + " */</style>", "<title>" + other + "</title>",
           "<script>\"" + std::string("<script id='qjulia-map'>") + "\"</script>",
           "<p title='" + other + "'>", "<![CDATA[ <a ]]>", std::string("1 < 2 </> <? x ?>"),
           std::string("<script id='other' id='qjulia-map'>{}</script>"),
           std::string("<script data-id='qjulia-map'>{}</script>")}) {
    CAPTURE(before);
    const PageFile page(std::string(text).insert(at + head.size(), before));
    CHECK(to_json(read_map(page.path)) == to_json(map));
  }
}

TEST_CASE("a page without a map is no map") {
  for (const char* text :
       {"<!DOCTYPE html>\n<p>a report</p>", "<svg></svg>", "<", "<!--", "<!-", "</", "<a b='",
        "<script id=qjulia-ma", "<script", "<script id=\"qjulia-map",
        "<!-- <script id='qjulia-map'>{}</script>", "<p id='qjulia-map'>{}</p>"}) {
    const PageFile page(text);
    CHECK_THROWS_WITH(read_map(page.path),
                      Catch::Matchers::ContainsSubstring("is a page without a map"));
  }
}

TEST_CASE("a page holds what its camera frames") {
  const std::vector<Eigen::Vector3d> outline{{0.5, -1, 2}, {3e-9, 0.1, -1e9}};
  const auto held = [](const std::string& page) {
    return nlohmann::json::parse(
        between(page, "<script type=\"application/json\" id=\"outline\">", "</script>"));
  };
  const std::string file = "ball.qjulia.json";
  for (const std::string& page : {explore::shared_page(nasty_map(), file, {"{}", 0}, outline),
                                  explore::served_page(nasty_map(), file, outline)}) {
    const auto points = held(page);
    REQUIRE(points.size() == outline.size());
    for (std::size_t i = 0; i < outline.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        CHECK(points[i][axis].get<double>() ==
              Catch::Approx(outline[i][static_cast<Eigen::Index>(axis)]).epsilon(1e-6).margin(0));
      }
    }
  }
}

TEST_CASE("a page's outline turns as the knob turns the shape") {
  // What a mesh of the turned map would have, by the box: its corners turn about the origin of
  // iteration, which lies at -translation / scale.
  Map map = nasty_map();
  map.frame.box = Box{{-1, -2, -3}, {1, 2, 3}};
  map.frame.shape_to_map = {2, {0, -2, 0}};
  const auto corners = explore::box_outline(map);
  REQUIRE(corners.size() == 8);
  const auto turned =
      explore::turned_outline(map, {{1, 1, 0}, {0, 3, 5}}, {Eigen::Vector3d::UnitZ(), 90});
  CHECK((turned[0] - Eigen::Vector3d(0, 2, 0)).norm() < 1e-12);
  CHECK((turned[1] - Eigen::Vector3d(-2, 1, 5)).norm() < 1e-12);
}

TEST_CASE("a shared page says which controls need a server") {
  const auto settings = [](const std::string& page) {
    return nlohmann::json::parse(
        between(page, "<script type=\"application/json\" id=\"settings\">", "</script>"));
  };
  const auto has = [](const nlohmann::json& of, const std::string& option) {
    return std::ranges::any_of(of["map"],
                               [&](const auto& each) { return each["option"] == option; });
  };
  const auto own = settings(shared(nasty_map()));
  const auto served = settings(explore::served_page(nasty_map(), "ball.qjulia.json", {}));
  for (const char* option : {"order-seed", "rotate"}) {
    CHECK_FALSE(has(own, option));
    CHECK(has(served, option));
  }
  CHECK(std::ranges::count(own["absent"], "rotate") == 1);
  CHECK(std::ranges::count(own["absent"], "order seed") == 1);
  CHECK(served["absent"].empty());
}

TEST_CASE("names in a page are text") {
  const std::string page = shared(nasty_map(), "a\"><script>alert(1)</script>.json");
  CHECK(page.find("<script>alert") == std::string::npos);
  CHECK(page.find("{{") == std::string::npos);
}

TEST_CASE("a page's policy names its script and its style") {
  const std::string page = shared(nasty_map());
  const std::string policy = between(page, "Content-Security-Policy\" content=\"", "\"");
  for (const auto& [begin, end] :
       {std::pair{"<script type=\"module\">", "</script>"}, std::pair{"<style>", "</style>"}}) {
    const PageFile part(between(page, begin, end));
    CHECK(policy.find("'sha256-" + sha256_of(part.path) + "'") != std::string::npos);
  }
  CHECK(policy.find("unsafe") == std::string::npos);
}
