/// Where outputs go, and what they never do: overwrite an input, replace what is no file, get lost.

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "obj_text.hpp"
#include "process.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;
using Arguments = std::vector<std::string>;

namespace {

/// A folder with a mesh and a map of it.
struct OutputFiles {
  TemporaryFolder folder;
  std::string mesh =
      folder.file("ball.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2))).string();
  std::string mesh_text = read_text(mesh);

  Arguments fit(const std::string& output, const Arguments& more = {}) const {
    Arguments all = {"fit", mesh, "-o", output, "--factors", "24", "--max-evaluations", "12"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  std::string map() const {
    const std::string file = folder / "ball.qjulia.json";
    REQUIRE(run_command(fit(file)).exit_code == 0);
    return file;
  }
};

/// Names the message, leaves every file as it was.
void check_refused(const OutputFiles& bench, const Arguments& arguments, const std::string& word,
                   int exit_code = 2) {
  std::map<std::string, std::string> before, after;
  for (const auto& name : bench.folder.names()) before[name] = read_text(bench.folder / name);
  const ProcessResult result = run_command(arguments, {.timeout = std::chrono::seconds(30)});
  for (const auto& name : bench.folder.names()) after[name] = read_text(bench.folder / name);
  CAPTURE(arguments, result.err);
  CHECK(result.exit_code == exit_code);
  CHECK_THAT(result.err, ContainsSubstring(word));
  CHECK(before == after);
}

/// In a shell, with the command's path as $0.
ProcessResult shell(const std::string& script, const Arguments& arguments) {
  Arguments all = {"/bin/bash", "-c", script, QJULIA_COMMAND};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return qjulia::test::run(all);
}

bool is_map(const std::string& text) {
  const json map = json::parse(text, nullptr, false);
  return map.is_object() && map.value("format", "") == "qjulia-map";
}

}  // namespace

TEST_CASE("no output is an input or another output") {
  const OutputFiles bench;
  const std::string map = bench.map();
  const auto in = [&](const char* name) { return bench.folder / name; };
  const std::string word = "would overwrite";
  std::filesystem::create_hard_link(bench.mesh, in("hard.json"));
  std::filesystem::create_symlink("ball.obj", in("soft.json"));
  check_refused(bench, bench.fit(in("hard.json")), word);
  check_refused(bench, bench.fit(in("soft.json")), word);
  check_refused(bench, bench.fit(in("new.json"), {"--trace", bench.mesh}), word);
  check_refused(bench, bench.fit(in("new.json"), {"--trace", in("new.json")}), word);
  check_refused(bench, bench.fit(in("new.json"), {"--trace", in("./new.json.checkpoint")}), word);
  check_refused(bench, {"render", map, "-o", in("a.png"), "--trace", map}, word);
  check_refused(bench, {"render", map, "-o", in("a.png"), "--trace", in("a.png")}, word);
  check_refused(
      bench, {"render", map, "-o", in("a.png"), "--preview", "--trace", in("a.preview.png")}, word);
  check_refused(bench, {"render", map, "-o", in("b.depth.png"), "--aov", in("b")}, word);
  check_refused(bench,
                {"render", map, "-o", in("a.png"), "--turntable", "2", "--trace", in("a_002.png")},
                word);
  check_refused(bench, {"surface", map, "-o", in("a.ply"), "--trace", in("a.ply")}, word);
  check_refused(bench, {"sample", map, "-o", in("a.npy"), "--trace", map}, word);
  check_refused(bench, {"compare", map, bench.mesh, "--trace", bench.mesh}, word);
  check_refused(bench, {"convert", map, map, "--detail", "0.03"}, word);
  const std::string baseline = bench.folder.file("before.json", "{}");
  check_refused(bench, {"profile", "measure", "--baseline", baseline, "--trace", baseline}, word);
  check_refused(bench, bench.fit(in("new.json"), {"--report", in("new.json")}), word);
}

TEST_CASE("every output is checked before the work") {
  const OutputFiles bench;
  const std::string map = bench.map();
  const auto in = [&](const char* name) { return bench.folder / name; };
  check_refused(bench, bench.fit(""), "--output");
  check_refused(bench, bench.fit(in("a.json"), {"--trace", ""}), "--trace");
  check_refused(bench, bench.fit(in("a.json"), {"--trace", in("no/a.json")}), "no folder", 1);
  check_refused(bench, bench.fit(in("a.json"), {"--report", bench.mesh}), "not a folder", 1);
  check_refused(bench, bench.fit(in("")), "it is a folder", 1);
  check_refused(bench, bench.fit(in(std::string(260, 'a').c_str())), "name too long", 1);
  check_refused(bench, {"render", map, "-o", in("a.png"), "--aov", in("no/a")}, "--aov", 1);
  check_refused(bench, {"surface", map, "-o", in("a.GLTF")}, ".glb");
  check_refused(bench, {"compare", map, bench.mesh, "--picture", in("a.jpg")}, ".png");
}

TEST_CASE("a preview replaces previews alone") {
  const OutputFiles bench;
  const std::string map = bench.map();
  const std::string picture = bench.folder / "a.png", preview = bench.folder / "a.preview.png";
  const Arguments render = {"render", map, "-o", picture, "--size", "40x30", "--preview"};
  bench.folder.file("a.preview.png", "somebody's own");
  check_refused(bench, render, "is not a preview");
  // One that an interrupted run left: a small picture says so of itself.
  std::filesystem::remove(preview);
  const ProcessResult kept = shell(
      "until [ -s \"$1\" ]; do sleep 0.01; done & seen=$!; left=$1; shift; "
      "\"$0\" \"$@\" & pid=$!; wait $seen; cp \"$left\" \"$left.kept\"; wait $pid",
      {preview, "render", map, "-o", picture, "--size", "640x480", "--preview"});
  CAPTURE(kept.err);
  REQUIRE(kept.exit_code == 0);
  std::filesystem::rename(preview + ".kept", preview);
  CHECK(run_command(render).exit_code == 0);
  CHECK_FALSE(std::filesystem::exists(preview));
}

TEST_CASE("a map tells of mesh and schedule as they were when its fit began") {
  const OutputFiles bench;
  const std::string map = bench.folder / "map.json";
  const std::string text = read_text(QJULIA_TEST_DATA "/../../host/fit/schedules/fast.toml");
  const std::string schedule = bench.folder.file("s.toml", text);
  const Arguments fit = {"fit",    bench.mesh,          "-o", map, "--factors", "48", "--schedule",
                         schedule, "--max-evaluations", "400"};
  Arguments all{map, bench.mesh, schedule};
  all.insert(all.end(), fit.begin(), fit.end());
  const ProcessResult first = shell(
      "map=$1; mesh=$2; schedule=$3; shift 3; \"$0\" \"$@\" & pid=$!; "
      "until [ -s \"$map.checkpoint\" ]; do sleep 0.01; done; "
      "rm \"$schedule\"; echo '# edited' >>\"$mesh\"; wait $pid",
      all);
  CAPTURE(first.err);
  REQUIRE(first.exit_code == 0);
  bench.folder.file("s.toml", text);
  Arguments resumed = fit;
  resumed.emplace_back("--resume");
  const ProcessResult second = run_command(resumed);
  CHECK(second.exit_code == 0);
  CHECK_THAT(second.err, !ContainsSubstring("nothing to resume"));
}

TEST_CASE("a batch never writes over its meshes") {
  const OutputFiles bench;
  const std::string manifest =
      bench.folder.file("m.toml",
                        "[defaults]\nfactors = 24\nmax_evaluations = 5\nsurface = \"obj\"\n"
                        "[[fit]]\nmesh = \"ball.obj\"\n");
  check_refused(bench, {"batch", "run", manifest, "-o", bench.folder / ""}, "m.toml:5");
  check_refused(bench, {"batch", "run", manifest, "-o", bench.folder / "", "--resume"}, "ball.obj");
}

TEST_CASE("links are followed, and an existing file's mode is kept") {
  const OutputFiles bench;
  std::filesystem::create_directory(bench.folder / "there");
  const std::string link = bench.folder / "link.json", target = bench.folder / "there/map.json";
  std::filesystem::create_symlink("there/map.json", link);
  REQUIRE(run_command(bench.fit(link)).exit_code == 0);
  CHECK(std::filesystem::is_symlink(link));
  CHECK(is_map(read_text(target)));
  ::chmod(target.c_str(), 0640);
  REQUIRE(run_command(bench.fit(link)).exit_code == 0);
  struct stat info {};
  REQUIRE(::stat(target.c_str(), &info) == 0);
  CHECK((info.st_mode & 0777U) == 0640U);
}

TEST_CASE("what is no regular file is written into") {
  const OutputFiles bench;
  struct stat before {
  }, after{};
  REQUIRE(::stat("/dev/null", &before) == 0);
  CHECK(run_command(bench.fit("/dev/null")).exit_code == 0);
  REQUIRE(::stat("/dev/null", &after) == 0);
  CHECK(S_ISCHR(after.st_mode));
  CHECK(before.st_ino == after.st_ino);
  CHECK_FALSE(std::filesystem::exists("/dev/null.checkpoint"));

  const ProcessResult full = run_command(bench.fit("/dev/full"));
  CHECK(full.exit_code == 1);
  CHECK_THAT(full.err, ContainsSubstring("cannot write '/dev/full'"));
  CHECK(is_map(run_command(bench.fit("/dev/stdout")).out));

  const std::string pipe = bench.folder / "pipe";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  std::string received;
  std::jthread reader([&] { received = read_text(pipe); });
  const ProcessResult piped = run_command(bench.fit(pipe));
  if (piped.exit_code != 0) ::close(::open(pipe.c_str(), O_WRONLY | O_NONBLOCK));
  reader.join();
  CHECK(piped.exit_code == 0);
  CHECK(is_map(received));
  CHECK(std::filesystem::is_fifo(pipe));
}

TEST_CASE("a command does not depend on anybody who listens") {
  const OutputFiles bench;
  const std::string map = bench.map();
  for (const char* redirection :
       {"2>&-", "2>/dev/full", ">&- 2>&-", "<&- >/dev/full 2>/dev/full"}) {
    CAPTURE(redirection);
    std::filesystem::remove(map);
    const ProcessResult result =
        shell(std::string("\"$0\" \"$@\" --verbose ") + redirection, bench.fit(map));
    CHECK(result.exit_code == 0);
    CHECK(is_map(read_text(map)));
    CHECK(read_text(bench.mesh) == bench.mesh_text);
  }
  const ProcessResult deaf = shell("\"$0\" \"$@\" >/dev/full", {"info", map});
  CHECK(deaf.exit_code == 1);
  CHECK_THAT(deaf.err, ContainsSubstring("standard output"));
  const ProcessResult gone = shell("\"$0\" \"$@\" | true; exit ${PIPESTATUS[0]}", {"info", map});
  CHECK(gone.exit_code == 0);
}

TEST_CASE("what a killed run left is gone after the next, and nothing else") {
  const OutputFiles bench;
  const auto file = [&](const char* name) { return bench.folder.file(name, "half").string(); };
  const std::string own = file("map.json.qjulia-0123456789abcdef.tmp");
  const Arguments others = {file("map.json.1234.tmp"), file("map.json.tmp"),
                            file("other.json.qjulia-0123456789abcdef.tmp"),
                            file("map.json.qjulia-0123.tmp")};
  const std::string in_use = file("map.json.qjulia-00000000aaaaaaaa.tmp");
  const int held = ::open(in_use.c_str(), O_RDONLY | O_CLOEXEC);
  REQUIRE(::flock(held, LOCK_EX) == 0);
  CHECK(run_command(bench.fit(bench.folder / "map.json")).exit_code == 0);
  ::close(held);
  CHECK_FALSE(std::filesystem::exists(own));
  CHECK(std::filesystem::exists(in_use));
  for (const std::string& other : others) CHECK(std::filesystem::exists(other));
}

TEST_CASE("two signals of one Ctrl-C count once") {
  const OutputFiles bench;
  const std::string map = bench.folder / "map.json";
  const ProcessResult result = shell(
      "map=$1; shift; \"$0\" \"$@\" -o \"$map\" & pid=$!; "
      "until [ -s \"$map.checkpoint\" ]; do sleep 0.01; done; "
      "kill -INT $pid; kill -TERM $pid; wait $pid",
      {map, "fit", bench.mesh, "--factors", "300"});
  CAPTURE(result.err);
  CHECK(result.exit_code == 130);
  CHECK(is_map(read_text(map)));
}

TEST_CASE("a hangup that nohup has ignored disturbs nothing, not even a compiler") {
  const OutputFiles bench;
  const std::string map = bench.map(), surface = bench.folder / "a.ply";
  // Kernels are compiled anew, and the compiler knows what to do with a hangup.
  const ProcessResult result = shell(
      "trap '' HUP; export POCL_CACHE_DIR=$1/cold; shift; \"$0\" \"$@\" & pid=$!; "
      "while kill -HUP $pid 2>/dev/null; do sleep 0.02; done; wait $pid",
      {bench.folder / "", "surface", map, "-o", surface, "--resolution", "8"});
  CAPTURE(result.err);
  CHECK(result.exit_code == 0);
  CHECK(std::filesystem::exists(surface));
}

TEST_CASE("fit warns as soon as a checkpoint cannot be written, and goes on") {
  const OutputFiles bench;
  const std::string map = bench.folder / "map.json";
  // A folder of its name is refused at once; one that comes later is in the way of each rename. The
  // fit is stopped when it has told, so that it cannot have ended by itself.
  const ProcessResult result = shell(
      "map=$1; shift; \"$0\" \"$@\" -o \"$map\" 2>\"$map.err\" & fit=$!\n"
      "until [ -s \"$map.checkpoint\" ]; do sleep 0.01; done\n"
      "rm \"$map.checkpoint\"; mkdir \"$map.checkpoint\"\n"
      "until grep -q warning \"$map.err\" || ! kill -0 $fit; do sleep 0.01; done\n"
      "kill -INT $fit; wait $fit; code=$?; cat \"$map.err\" >&2; exit $code",
      {map, "fit", bench.mesh, "--factors", "300", "--quiet"});
  CAPTURE(result.err);
  CHECK(result.exit_code == 130);
  const std::string warning = "warning: the fit cannot be kept while it is under way: cannot write";
  CHECK_THAT(result.err,
             ContainsSubstring(warning + " '" + map + ".checkpoint': it cannot be replaced"));
  CHECK(result.err.find(warning) == result.err.rfind(warning));
  CHECK(is_map(read_text(map)));
}

TEST_CASE("a fit whose folder goes while it runs keeps its map elsewhere") {
  const OutputFiles bench;
  const TemporaryFolder others;
  // The first evaluations are over when there is a checkpoint.
  const auto result = run(
      {"/bin/bash", "-c",
       "mkdir \"$2/gone\"; \"$0\" fit \"$1\" -o \"$2/gone/m.json\" --factors 24 --quiet & fit=$!\n"
       "until test -e \"$2/gone/m.json.checkpoint\" || ! kill -0 $fit; do sleep 0.01; done\n"
       "rm -r \"$2/gone\"; wait $fit",
       QJULIA_COMMAND, bench.mesh, bench.folder.path().string()},
      {.environment = {{"TMPDIR", others.path().string()}}});
  INFO(result.err);
  CHECK(result.exit_code == 1);
  const std::vector<std::string> kept = others.names();
  REQUIRE(kept.size() == 1);
  CHECK_THAT(result.err, ContainsSubstring("The map that was reached is in") &&
                             ContainsSubstring(kept.front()));
  CHECK(run_command({"info", others / kept.front()}).exit_code == 0);
}

TEST_CASE("--resume knows a schedule by what it says") {
  const OutputFiles bench;
  const std::string map = bench.folder / "map.json";
  const std::string text = read_text(QJULIA_TEST_DATA "/../../host/fit/schedules/fast.toml");
  const std::string schedule = bench.folder.file("s.toml", text);
  const Arguments fit = bench.fit(map, {"--schedule", schedule, "--resume"});
  const ProcessResult first = run_command(fit);
  CAPTURE(first.err);
  REQUIRE(first.exit_code == 0);
  CHECK_THAT(run_command(fit).err, ContainsSubstring("nothing to resume"));
  bench.folder.file("s.toml", text + "# other\n");
  const ProcessResult edited = run_command(fit);
  CHECK(edited.exit_code == 0);
  CHECK_THAT(edited.err, !ContainsSubstring("nothing to resume"));
}

TEST_CASE("--resume makes the report of a finished map") {
  const OutputFiles bench;
  const std::string map = bench.map(), bytes = read_text(map);
  const ProcessResult result =
      run_command(bench.fit(map, {"--resume", "--report", bench.folder / "report"}));
  CAPTURE(result.err);
  CHECK(result.exit_code == 0);
  CHECK(read_text(map) == bytes);
  CHECK_THAT(read_text(bench.folder / "report/report.html"), ContainsSubstring("How it went"));
}

TEST_CASE("an output that nobody names is named after the input, and must be new") {
  const TemporaryFolder folder;
  const std::string map = QJULIA_TEST_DATA "/../../docs/maps/quadratic.qjulia.json";
  const auto here = [&](const std::string& words) {
    return run({"/bin/bash", "-c", "cd \"$1\" && exec \"$0\" " + words, QJULIA_COMMAND,
                folder.path().string(), map});
  };
  const auto drawn = here("render \"$2\" --size 32x24 --json");
  INFO(drawn.err);
  REQUIRE(drawn.exit_code == 0);
  CHECK_THAT(drawn.out, ContainsSubstring("\"quadratic.png\""));
  REQUIRE(std::filesystem::exists(folder / "quadratic.png"));
  const auto again = here("render \"$2\" --size 32x24");
  CHECK(again.exit_code == 2);
  CHECK_THAT(again.err, ContainsSubstring("--output: 'quadratic.png' exists"));
  CHECK(here("render \"$2\" --size 32x24 -o quadratic.png").exit_code == 0);
  // A name that a sweep makes of it counts too.
  std::filesystem::rename(folder / "quadratic.png", folder / "quadratic_002.png");
  CHECK_THAT(here("render \"$2\" --size 32x24 --sweep azimuth=0,90").err,
             ContainsSubstring("'quadratic_002.png' exists"));

  REQUIRE(here("surface \"$2\" --resolution 16").exit_code == 0);
  CHECK(std::filesystem::exists(folder / "quadratic.ply"));
  REQUIRE(here("sample \"$2\" --resolution 8").exit_code == 0);
  CHECK(std::filesystem::exists(folder / "quadratic.npy"));
  REQUIRE(here("share \"$2\"").exit_code == 0);
  CHECK(std::filesystem::exists(folder / "quadratic.html"));
  CHECK_THAT(here("share quadratic.html").err, ContainsSubstring("would overwrite the input"));
  REQUIRE(here("convert \"$2\"").exit_code == 0);
  CHECK(std::filesystem::exists(folder / "quadratic.qjulia.json"));
  CHECK_THAT(here("convert \"$2\"").err, ContainsSubstring("OUT: 'quadratic.qjulia.json' exists"));
}

TEST_CASE("a fit's map is named after its mesh, and --resume finds it") {
  const TemporaryFolder folder;
  const std::string mesh = QJULIA_TEST_DATA "/icosahedron.obj";
  const auto fit = [&](const std::string& options) {
    return run({"/bin/bash", "-c", "cd \"$1\" && exec \"$0\" fit \"$2\" --factors 8 " + options,
                QJULIA_COMMAND, folder.path().string(), mesh});
  };
  const auto first = fit("--max-evaluations 4");
  INFO(first.err);
  REQUIRE(first.exit_code == 0);
  REQUIRE(std::filesystem::exists(folder / "icosahedron.qjulia.json"));
  CHECK_THAT(fit("--max-evaluations 4").err, ContainsSubstring("'icosahedron.qjulia.json' exists"));
  CHECK_THAT(fit("--max-evaluations 4 --resume").err, ContainsSubstring("is finished"));
  // That of another run is not resumed, and stays.
  CHECK_THAT(fit("--max-evaluations 5 --resume").err,
             ContainsSubstring("'icosahedron.qjulia.json' exists"));
}
