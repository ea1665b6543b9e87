#include <sys/stat.h>

#include <catch2/catch_all.hpp>
#include <limits>

#include "batch/batch.hpp"
#include "batch/sweep.hpp"
#include "point_cache.hpp"
#include "qjulia/base/error.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using qjulia::InputError;

using namespace qjulia;
using qjulia::test::TemporaryFolder;

namespace {

/// Knows `factors`, `detail`, `time-limit`, `schedule` and the flag `polish`; refuses 0 factors,
/// and polish with detail.
void check_options(const std::vector<batch::ManifestOption>& options) {
  bool polish = false;
  bool detail = false;
  for (const auto& [name, values, line] : options) {
    polish = polish || name == "polish";
    detail = detail || name == "detail";
    if (name != "polish" && name != "detail" && name != "factors" && name != "time-limit" &&
        name != "schedule") {
      throw InputError("unknown key '" + name + "'");
    }
    if (name == "factors" && values.front() == "0") throw InputError("no factors");
  }
  if (polish && detail) throw InputError("either polish or detail");
}

/// Jobs may have a size, a resolution and a look, which may be a file.
void check_job(batch::EntryJob& job, const std::filesystem::path& folder) {
  for (auto& [name, value] : job.options.items()) {
    if (name != "size" && name != "resolution" && name != "look") {
      throw InputError("no option '" + name + "'");
    }
    if (name == "look") value = (folder / value.get<std::string>()).string();
  }
}

const batch::ManifestChecks kChecks{check_options, check_job};

batch::Manifest read(const TemporaryFolder& folder, const std::string& text,
                     bool may_miss = false) {
  return qjulia::batch::read_manifest(folder.file("m.toml", text), kChecks, may_miss);
}

std::string problems(const TemporaryFolder& folder, const std::string& text) {
  try {
    read(folder, text);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("a manifest's entries have their own options and the defaults") {
  const TemporaryFolder folder;
  folder.file("a.obj", "");
  folder.file("b.obj", "");
  const batch::Manifest manifest = read(folder, R"([defaults]
factors = 24
time_limit = 1.5
picture = true
[[fit]]
mesh = "b.obj"
[[fit]]
name = "second"
mesh = "a.obj"
factors = 100
surface = { type = "stl", resolution = 24 }
picture = false
[[fit]]
name = "third"
mesh = "a.obj"
surface = "vdb"
[fit.picture]
size = "32x24"
look = "mine.toml"
)");
  REQUIRE(manifest.entries.size() == 3);
  const auto& first = manifest.entries[0];
  CHECK(first.name == "b");
  CHECK(first.mesh == folder.path() / "b.obj");
  CHECK(first.line == 5);
  REQUIRE(first.outputs.picture);
  CHECK(first.outputs.picture->command == "render");
  CHECK(first.outputs.picture->extension == ".png");
  CHECK(first.outputs.picture->options == nlohmann::json{{"size", "640x480"}});
  CHECK_FALSE(first.outputs.surface);
  REQUIRE(first.options.size() == 2);
  CHECK(first.options[0].name == "factors");
  CHECK(first.options[0].values == std::vector<std::string>{"24"});
  CHECK(first.options[1].name == "time-limit");
  CHECK(first.options[1].values == std::vector<std::string>{"1.5"});
  const auto& second = manifest.entries[1];
  CHECK(second.name == "second");
  CHECK_FALSE(second.outputs.picture);
  REQUIRE(second.outputs.surface);
  CHECK(second.outputs.surface->command == "surface");
  CHECK(second.outputs.surface->extension == ".stl");
  CHECK(second.outputs.surface->options == nlohmann::json{{"resolution", 24}});
  const auto& third = manifest.entries[2];
  CHECK(third.outputs.surface->extension == ".vdb");
  REQUIRE(third.outputs.picture);
  CHECK(third.outputs.picture->options ==
        nlohmann::json{{"size", "32x24"}, {"look", (folder.path() / "mine.toml").string()}});
  REQUIRE(second.options.size() == 2);
  CHECK(second.options[0].values == std::vector<std::string>{"100"});
}

TEST_CASE("an entry can take a default flag back") {
  const TemporaryFolder folder;
  folder.file("a.obj", "");
  const batch::Manifest manifest = read(folder, R"(defaults = { polish = true }
[[fit]]
mesh = "a.obj"
polish = false
detail = 0.02
[[fit]]
mesh = "a.obj"
name = "b"
)");
  REQUIRE(manifest.entries[0].options.size() == 1);
  CHECK(manifest.entries[0].options[0].name == "detail");
  REQUIRE(manifest.entries[1].options.size() == 1);
  CHECK(manifest.entries[1].options[0].values.empty());
}

TEST_CASE("a glob stands for every mesh it matches") {
  const TemporaryFolder folder;
  for (const char* name : {"c.obj", "a.PLY", "b.stl", "notes.md"}) folder.file(name, "");
  const batch::Manifest manifest = read(folder, "[[fit]]\nmesh = \"*\"\nname = \"fine-*\"\n");
  REQUIRE(manifest.entries.size() == 3);
  CHECK(manifest.entries[0].name == "fine-a");
  CHECK(manifest.entries[2].name == "fine-c");
  CHECK_THAT(problems(folder, "[[fit]]\nmesh = \"*\"\nname = \"one\"\n"),
             ContainsSubstring("m.toml:1:") && ContainsSubstring("asterisk"));
  CHECK_THAT(problems(folder, "[[fit]]\nmesh = \"*.off\"\n"),
             ContainsSubstring("m.toml:1: no mesh matches '*.off'"));
}

TEST_CASE("a glob takes the manifest's folder as it is called") {
  const TemporaryFolder folder;
  for (const char* name : {"x[1]", "x1", "a\\*"}) std::filesystem::create_directory(folder / name);
  for (const char* name : {"x[1]/a.obj", "x1/b.obj", "a\\*/c.obj"}) folder.file(name, "");
  const auto only_mesh = [&](const std::string& name, const std::string& pattern) {
    const auto manifest = qjulia::batch::read_manifest(
        folder.file(name, "[[fit]]\nmesh = '" + pattern + "'\n"), kChecks);
    REQUIRE(manifest.entries.size() == 1);
    return manifest.entries[0].mesh;
  };
  CHECK(only_mesh("x[1]/m.toml", "*.obj") == folder.path() / "x[1]/a.obj");
  CHECK(only_mesh("a\\*/m.toml", "?.obj") == folder.path() / "a\\*/c.obj");
  CHECK(only_mesh("x[1]/m.toml", folder / "x1/*.obj") == folder.path() / "x1/b.obj");
}

TEST_CASE("a mesh is a regular file of a mesh's type") {
  const TemporaryFolder folder;
  folder.file("f.json", "");
  folder.file("a.obj", "");
  std::filesystem::create_directory(folder / "d.obj");
  REQUIRE(::mkfifo((folder / "p.obj").c_str(), 0600) == 0);
  const std::string told = problems(folder, R"([[fit]]
mesh = "f.json"
[[fit]]
mesh = "/dev/null"
[[fit]]
mesh = "d.obj"
[[fit]]
mesh = "p.obj"
)");
  CHECK_THAT(told, ContainsSubstring("m.toml:1: mesh '") &&
                       ContainsSubstring("f.json' must be a file whose name "
                                         "ends in .obj"));
  CHECK_THAT(told, ContainsSubstring("m.toml:3: mesh '/dev/null' must be"));
  CHECK_THAT(told,
             ContainsSubstring("m.toml:5: mesh '") && ContainsSubstring("d.obj' is a folder"));
  CHECK_THAT(
      told, ContainsSubstring("m.toml:7: mesh '") && ContainsSubstring("p.obj' is a folder, pipe"));
  CHECK(read(folder, "[[fit]]\nmesh = \"*.obj\"\n").entries.size() == 1);
}

TEST_CASE("a schedule's file is in the manifest's folder") {
  const TemporaryFolder folder;
  folder.file("a.obj", "");
  const auto schedule = [&](const std::string& name) {
    const auto manifest = read(folder, "[[fit]]\nmesh = \"a.obj\"\nschedule = \"" + name + "\"\n");
    return manifest.entries[0].options[0].values.front();
  };
  CHECK(schedule("fast") == "fast");
  CHECK(schedule("s.toml") == folder / "s.toml");
  CHECK(schedule("/s.toml") == "/s.toml");
}

TEST_CASE("all that is wrong with a manifest is told by file and line") {
  const TemporaryFolder folder;
  folder.file("a.obj", "");
  const std::string told = problems(folder, R"([defaults]
factorz = 24
[[fit]]
mesh = "a.obj"
factors = 0
picture = "yes"
[[fit]]
mesh = "absent.obj"
[[fit]]
mesh = "a.obj"
[[fit]]
mesh = "a.obj"
name = "x/y"
[[fit]]
factors = 10
[[fit]]
mesh = "a.obj"
name = "both"
polish = true
detail = 0.1
surface = "doc"
[fit.picture]
sighs = "32x24"
)");
  CHECK_THAT(told, ContainsSubstring("m.toml:2: unknown key 'factorz'"));
  CHECK_THAT(told, ContainsSubstring("m.toml:5: no factors"));
  CHECK_THAT(told, ContainsSubstring("m.toml:6: 'picture' must be true or false"));
  CHECK_THAT(told,
             ContainsSubstring("m.toml:7: there is no mesh") && ContainsSubstring("absent.obj"));
  CHECK_THAT(told, ContainsSubstring("m.toml:9: 'a' is the name of the fit in line 3 too"));
  CHECK_THAT(told, ContainsSubstring("m.toml:11: a fit cannot be named 'x/y'"));
  CHECK_THAT(told, ContainsSubstring("m.toml:14: this [[fit]] has no 'mesh'"));
  CHECK_THAT(told, ContainsSubstring("m.toml:16: either polish or detail"));
  CHECK_THAT(told, ContainsSubstring("m.toml:21: 'surface' must be true, false, a table"));
  CHECK_THAT(told, ContainsSubstring("m.toml:22: render: no option 'sighs'"));
}

TEST_CASE("what is no manifest is refused") {
  const TemporaryFolder folder;
  CHECK_THAT(problems(folder, "[[fit]]\nmesh = \n"), ContainsSubstring("m.toml:2: not TOML"));
  CHECK_THAT(problems(folder, "[[fit]]\nmesh = \"a\"\nmesh = \"b\"\n"),
             ContainsSubstring("m.toml:3:"));
  CHECK_THAT(problems(folder, ""), ContainsSubstring("m.toml:1: there is nothing to fit"));
  CHECK_THAT(problems(folder, "fit = 3\n"), ContainsSubstring("m.toml:1: 'fit' is not known here"));
  CHECK_THAT(problems(folder, "[output]\na = 1\n"),
             ContainsSubstring("'output' is not known here"));
  CHECK_THAT(problems(folder, "[defaults]\nmesh = \"a\"\n"),
             ContainsSubstring("m.toml:2: 'mesh' belongs in a [[fit]], not in [defaults]"));
  CHECK_THAT(problems(folder, "[defaults]\nfactors = [24, 48]\n"),
             ContainsSubstring("m.toml:2: 'factors' must be a number"));
  CHECK_THROWS_AS(qjulia::batch::read_manifest(folder / "absent.toml", kChecks), InputError);
}

TEST_CASE("NUL in text and over-long globs in a manifest are reported by line") {
  const TemporaryFolder folder;
  folder.file("a.obj", "");
  CHECK_THAT(problems(folder, "[[fit]]\nmesh = \"a.obj\\u0000x\"\n"),
             ContainsSubstring("m.toml:2: 'mesh' must be text, without NUL"));
  CHECK_THAT(problems(folder, "[[fit]]\nmesh = \"a.obj\"\nname = \"a\\u0000b\"\n"),
             ContainsSubstring("m.toml:3: 'name' must be text, without NUL"));
  CHECK_THAT(problems(folder, "[[fit]]\nmesh = \"a.obj\"\nschedule = \"\\u0000\"\n"),
             ContainsSubstring("m.toml:3: 'schedule' must be a number, a string without NUL"));
  CHECK_THAT(problems(folder, "[[fit]]\nmesh = \"z" + std::string(3000, '*') + ".obj\"\n"),
             ContainsSubstring("m.toml:1: no mesh matches"));
}

TEST_CASE("a resumed batch may have lost meshes") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = read(folder, "[[fit]]\nmesh = \"gone.obj\"\n", true);
  REQUIRE(manifest.entries.size() == 1);
  CHECK(manifest.entries[0].name == "gone");
}

TEST_CASE("a sequence makes a fit of each frame, which follows the one before") {
  const TemporaryFolder folder;
  for (const char* name : {"w10.obj", "w9.obj", "w008.obj", "x.md", "alone.obj"}) {
    folder.file(name, "");
  }
  const auto entries =
      read(folder, "[[fit]]\nsequence = \"w*\"\nname = \"f-*\"\n[[fit]]\nmesh = \"alone.obj\"\n")
          .entries;
  REQUIRE(entries.size() == 4);
  const std::vector<std::pair<std::string, std::string>> expected{
      {"f-w008", ""}, {"f-w9", "f-w008"}, {"f-w10", "f-w9"}, {"alone", ""}};
  for (std::size_t i = 0; i < entries.size(); ++i) {
    CHECK(entries[i].name == expected[i].first);
    CHECK(entries[i].follows == expected[i].second);
  }
  // Each combination of a sweep is a sequence of its own.
  const auto swept =
      read(folder, "[[sweep]]\nsequence = [\"w9.obj\", \"w10.obj\"]\nfactors = [8, 9]\n").entries;
  REQUIRE(swept.size() == 4);
  CHECK(swept[1].follows.empty());
  CHECK(swept[2].follows == "w9-factors8");
  CHECK(swept[3].follows == "w9-factors9");

  CHECK_THAT(problems(folder, "[[fit]]\nsequence = \"z*.obj\"\n"),
             ContainsSubstring("m.toml:1: no mesh matches 'z*.obj'"));
  CHECK_THAT(problems(folder, "[[fit]]\nsequence = \"al*.obj\"\n"),
             ContainsSubstring("m.toml:1: the sequence has one frame"));
  CHECK_THAT(problems(folder, "[[fit]]\nsequence = \"w*\"\nmesh = \"alone.obj\"\n"),
             ContainsSubstring("m.toml:1: this [[fit]] has 'mesh' and 'sequence'"));
  CHECK_THAT(problems(folder, "[[fit]]\nsequence = \"w*\"\nname = \"one\"\n"),
             ContainsSubstring("m.toml:1: 'w*' matches 3 meshes"));
  CHECK_THAT(problems(folder, "[defaults]\nsequence = \"w*\"\n"),
             ContainsSubstring("m.toml:2: 'sequence' belongs in a [[fit]]"));
}

TEST_CASE("a point cache makes a fit of each of its frames") {
  const TemporaryFolder folder;
  const std::vector<TriangleMesh> frames(3, shapes::sphere(0));
  const std::string faces = test::faces_text(frames[0]);
  folder.file("w.npz", test::saved_cache(test::vertices_text<float>(frames), faces));
  folder.file("one.npz", test::saved_cache(test::vertices_text<float>({frames[0]}), faces));
  folder.file("bad.npz", "bad");
  const auto entries =
      read(folder, "[[sweep]]\nsequence = \"w.npz\"\nname = \"f-*\"\nfactors = [8, 9]\n").entries;
  REQUIRE(entries.size() == 6);
  CHECK(entries[0].name == "f-w_0001-factors8");
  CHECK(entries[0].follows.empty());
  CHECK(entries[5].name == "f-w_0003-factors9");
  CHECK(entries[5].follows == "f-w_0002-factors9");
  CHECK(entries[5].frame == 2);
  CHECK(entries[5].mesh == folder.path() / "w.npz");

  CHECK_THAT(problems(folder, "[[fit]]\nsequence = \"one.npz\"\n"),
             ContainsSubstring("m.toml:1: the sequence has one frame"));
  CHECK_THAT(problems(folder, "[[fit]]\nsequence = \"bad.npz\"\n"),
             ContainsSubstring("bad.npz': it is not a complete ZIP archive"));
  CHECK_THAT(problems(folder, "[[fit]]\nsequence = \"none.npz\"\n"),
             ContainsSubstring("none.npz': there is no such file"));
  CHECK_THAT(problems(folder, "[[sweep]]\nsequence = [\"w.npz\", \"one.npz\"]\n"),
             ContainsSubstring("w.npz' is a whole sequence; give it alone"));
  CHECK_THAT(problems(folder, "[[fit]]\nsequence = \"w.npz\"\nname = \"one\"\n"),
             ContainsSubstring("m.toml:1: 'w.npz' matches 3 meshes"));
  CHECK_THAT(problems(folder, "[[fit]]\nmesh = \"w.npz\"\n"),
             ContainsSubstring("m.toml:1: mesh") && ContainsSubstring("whose name ends in .obj"));
}

TEST_CASE("a sweep makes a fit of each mesh and each combination, with names that stay") {
  const TemporaryFolder folder;
  folder.file("a.obj", "");
  folder.file("b.obj", "");
  const auto names_of = [&](const std::string& text) {
    std::vector<std::string> names;
    for (const batch::BatchEntry& entry : read(folder, text).entries) names.push_back(entry.name);
    return names;
  };
  const std::string sweep = R"([defaults]
time_limit = 5
factors = 7
[[sweep]]
mesh = "*.obj"
factors = [100, 331]
detail = [0.005, 0.02]
compare = [6, 1]
[[fit]]
mesh = "a.obj"
)";
  const std::vector<std::string> expected = {
      "a-detail0.005-factors100", "a-detail0.005-factors331", "a-detail0.02-factors100",
      "a-detail0.02-factors331",  "b-detail0.005-factors100", "b-detail0.005-factors331",
      "b-detail0.02-factors100",  "b-detail0.02-factors331",  "a"};
  CHECK(names_of(sweep) == expected);
  const batch::Manifest manifest = read(folder, sweep);
  const batch::BatchEntry& third = manifest.entries[2];
  std::vector<std::string> options;
  for (const auto& option : third.options) {
    options.push_back(option.name + "=" + option.values.front());
  }
  CHECK(options == std::vector<std::string>{"detail=0.02", "factors=100", "time-limit=5"});
  CHECK(third.outputs.compare == std::vector<int>{1, 6});
  CHECK(manifest.entries.back().outputs.compare.empty());

  // Whatever the order of lines, and a list of one value names it, too.
  CHECK(names_of("[[sweep]]\nfactors = [9]\nmesh = [\"b.obj\", \"a.obj\"]\nname = \"x-*\"\n"
                 "polish = [true, false]\n") ==
        std::vector<std::string>{"x-b-factors9-polishtrue", "x-b-factors9-polishfalse",
                                 "x-a-factors9-polishtrue", "x-a-factors9-polishfalse"});
  CHECK(names_of("[[sweep]]\nmesh = \"a.obj\"\nschedule = [\"in/v.toml\", \"fast\"]\n") ==
        std::vector<std::string>{"a-schedulev", "a-schedulefast"});
  CHECK(names_of("[[sweep]]\nmesh = \"a.obj\"\nschedule = [\"in/v*\"]\n") ==
        std::vector<std::string>{"a-schedulein_v_"});
  CHECK(names_of("[[sweep]]\nmesh = \"a.obj\"\n") == std::vector<std::string>{"a"});
}

TEST_CASE("a sweep with several errors reports them all at once") {
  const TemporaryFolder folder;
  folder.file("a.obj", "");
  folder.file("b.obj", "");
  std::string many = "[";
  for (int i = 1; i <= 400; ++i) many += std::to_string(i) + ",";
  many += "]";
  const std::string told = problems(folder, R"([[sweep]]
mesh = ["a.obj", 3, "absent.obj"]
factors = [0, 5, 5.0, 5]
factorz = [1, 2]
detail = []
compare = [1, 99, 1]
surface = ["ply", "stl"]
[[sweep]]
mesh = "*.obj"
name = "same"
factors = [1, 2]
[[sweep]]
mesh = "a.obj"
polish = [true, false]
detail = [0.1, 0.2]
[[sweep]]
factors = [3]
[[sweep]]
mesh = "a.obj"
factors = )" + many + "\ntime_limit = " + many + "\n");
  CHECK_THAT(told, ContainsSubstring("m.toml:2: 'mesh' must be text, without NUL"));
  CHECK_THAT(told,
             ContainsSubstring("m.toml:1: there is no mesh") && ContainsSubstring("absent.obj"));
  CHECK_THAT(told, ContainsSubstring("m.toml:3: no factors"));
  CHECK_THAT(told, ContainsSubstring("m.toml:3: 'factors' lists two values") &&
                       ContainsSubstring("call '5'"));
  CHECK_THAT(told, ContainsSubstring("m.toml:4: unknown key 'factorz'"));
  CHECK_THAT(told, ContainsSubstring("m.toml:5: 'detail' is an empty list"));
  CHECK_THAT(told,
             ContainsSubstring("m.toml:6: each n of 'compare' must be a whole number, 1 to 16") &&
                 ContainsSubstring("m.toml:6: 'compare' lists 1 twice"));
  CHECK_THAT(told, ContainsSubstring("m.toml:7: 'surface' must be true, false"));
  CHECK_THAT(told, ContainsSubstring("m.toml:8: '*.obj' matches 2 meshes"));
  CHECK_THAT(told, ContainsSubstring("m.toml:12: either polish or detail"));
  CHECK_THAT(told, ContainsSubstring("m.toml:16: this [[sweep]] has no 'mesh'"));
  CHECK_THAT(told, ContainsSubstring("m.toml:18: this [[sweep]] makes more than 100000 fits"));
  // An error that several values or combinations share is reported once.
  for (const char* once : {"unknown key 'factorz'", "either polish or detail"}) {
    CHECK(told.find(once) == told.rfind(once));
  }
  CHECK_THAT(problems(folder, "[[fit]]\nmesh = \"a.obj\"\nfactors = [1, 2]\n"),
             ContainsSubstring("m.toml:3: 'factors' must be a number") &&
                 ContainsSubstring("lists belong in a [[sweep]]"));
}

TEST_CASE("combinations without number are counted as the largest one") {
  const batch::SweepAxis axis{"factors", {{"1", std::nullopt}, {"2", std::nullopt}}};
  CHECK(batch::combination_count({}) == 1);
  CHECK(batch::combination_count({axis, axis, axis}) == 8);
  CHECK(batch::combination_count({axis, {"detail", {}}}) == 0);
  CHECK(batch::combination_count(std::vector<batch::SweepAxis>(64, axis)) ==
        std::numeric_limits<std::size_t>::max());
}
