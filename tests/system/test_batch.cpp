/// Batches, as a user runs, kills and resumes them.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <csignal>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "batch_folder.hpp"
#include "point_cache.hpp"
#include "process.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;
using Arguments = std::vector<std::string>;

namespace {

std::size_t statuses_done(const std::string& folder) {
  return static_cast<std::size_t>(std::ranges::count_if(kGoodFits, [&](const std::string& name) {
    return read_text(folder + "/" + name + ".status.json").find("\"done\"") != std::string::npos;
  }));
}

void check_five_and_one(const std::string& folder) {
  const json all = read_summary(folder);
  CHECK(all["counts"]["done"] == 5);
  CHECK(all["counts"]["failed"] == 1);
  for (const json& entry : all["entries"]) {
    if (entry["name"] == "empty") {
      CHECK(entry["state"] == "failed");
      CHECK_THAT(entry["error"].get<std::string>(), ContainsSubstring("empty.obj"));
    } else {
      CHECK(entry["figures"]["iou"].get<double>() > 0.3);
    }
  }
}

}  // namespace

TEST_CASE("a batch that is killed is resumed without touching what was done") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  const std::string out = folder / "out";
  const ProcessResult killed =
      run_command({"batch", "run", manifest, "-o", out}, {.kill_at = "[2/6]"});
  CHECK(killed.exit_code == 128 + SIGKILL);
  const std::size_t done = statuses_done(out);
  CHECK(done >= 1);
  CHECK(done < 5);
  CHECK_FALSE(std::filesystem::exists(out + "/summary.json"));
  std::map<std::string, std::filesystem::file_time_type> times;
  for (const std::string& name : kGoodFits) {
    const std::string status = read_text(out + "/" + name + ".status.json");
    if (status.find("\"done\"") == std::string::npos) continue;
    times[name] = std::filesystem::last_write_time(out + "/" + name + ".qjulia.json");
  }

  const ProcessResult resumed = run_command({"batch", "run", manifest, "-o", out, "--resume"});
  CAPTURE(resumed.err);
  CHECK(resumed.exit_code == 1);
  CHECK_THAT(resumed.err, ContainsSubstring("empty.obj"));
  check_five_and_one(out);
  for (const auto& [name, time] : times) {
    CHECK(std::filesystem::last_write_time(out + "/" + name + ".qjulia.json") == time);
  }
  for (const auto& file : std::filesystem::directory_iterator(out)) {
    const std::string name = file.path().filename().string();
    CHECK_FALSE(name.ends_with(".tmp"));
  }
  CHECK(run_command({"batch", "run", manifest, "-o", out, "--resume"}).exit_code == 1);
}

TEST_CASE("an entry that was killed goes on from its checkpoint, to the same bytes") {
  const TemporaryFolder folder;
  folder.file("ball.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  const std::string manifest = folder.file(
      "m.toml", "[defaults]\nfactors = 24\nmax_evaluations = 3000\n[[fit]]\nmesh = \"ball.obj\"\n");
  const std::string unbroken = folder / "unbroken";
  const std::string out = folder / "out";
  REQUIRE(run_command({"batch", "run", manifest, "-o", unbroken}).exit_code == 0);
  CHECK_FALSE(std::filesystem::exists(unbroken + "/ball.checkpoint"));

  RunOptions options;
  options.kill_once = out + "/ball.checkpoint";
  REQUIRE(run_command({"batch", "run", manifest, "-o", out}, options).exit_code == 128 + SIGKILL);
  REQUIRE(std::filesystem::exists(options.kill_once));
  CHECK_FALSE(std::filesystem::exists(out + "/ball.qjulia.json"));
  REQUIRE(run_command({"batch", "run", manifest, "-o", out, "--resume"}).exit_code == 0);
  CHECK(map_bytes(out, "ball") == map_bytes(unbroken, "ball"));
  CHECK_FALSE(std::filesystem::exists(options.kill_once));

  // One that is spoilt is left aside: the entry is fitted afresh.
  std::filesystem::remove_all(out);
  REQUIRE(run_command({"batch", "run", manifest, "-o", out}, options).exit_code == 128 + SIGKILL);
  folder.file("out/ball.checkpoint", "spoilt");
  REQUIRE(run_command({"batch", "run", manifest, "-o", out, "--resume"}).exit_code == 0);
  CHECK(map_bytes(out, "ball") == map_bytes(unbroken, "ball"));
}

TEST_CASE("side by side gives the same bytes as one after another") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder, "surface = { resolution = 24 }\n");
  CHECK(run_command({"batch", "run", manifest, "-o", folder / "one"}).exit_code == 1);
  CHECK(run_command({"batch", "run", manifest, "-o", folder / "two", "--jobs", "auto"}).exit_code ==
        1);
  check_five_and_one(folder / "two");
  for (const std::string& name : kGoodFits) {
    CHECK_FALSE(map_bytes(folder / "one", name).empty());
    CHECK(map_bytes(folder / "one", name) == map_bytes(folder / "two", name));
    CHECK(read_text(folder / ("one/" + name + ".ply")) ==
          read_text(folder / ("two/" + name + ".ply")));
  }
}

TEST_CASE("the maps of a batch are those of single fits") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder, "up = \"-y\"\n");
  const std::string map = folder / "box.qjulia.json";
  CHECK(run_command({"batch", "run", manifest, "-o", folder / "out"}).exit_code == 1);
  CHECK(run_command(
            {"fit", folder / "box.obj", "-o", map, "--factors", "24", "--max-evaluations", "40"})
            .exit_code == 0);
  const json single = json::parse(read_text(map));
  const json batch = json::parse(map_bytes(folder / "out", "box"));
  CHECK(batch["up"] == "-y");
  CHECK(single["up"] == "y");
  for (const char* key : {"factors", "log_scale", "surface_level"})
    CHECK(single[key] == batch[key]);
}

TEST_CASE("each frame of a mesh that walks is fitted from the one before, to the same bytes") {
  const TemporaryFolder folder;
  constexpr int kFrames = 4;
  // A worm of length 5 that bends along its way.
  for (int frame = 0; frame < kFrames; ++frame) {
    qjulia::TriangleMesh worm = qjulia::shapes::sphere(3);
    for (Eigen::Vector3d& v : worm.vertices) {
      v.x() *= 2.5;
      v.z() += 0.4 * std::sin(1.5 * v.x() - 0.25 * frame);
    }
    folder.file("walk" + std::to_string(9 + frame) + ".obj", qjulia::test::obj_text(worm));
  }
  const std::string defaults = "[defaults]\nfactors = 48\nmax_evaluations = 400\n";
  const std::string manifest =
      folder.file("m.toml", defaults + "[[fit]]\nsequence = \"walk*.obj\"\n");
  const std::string afresh = folder.file("n.toml", defaults + "[[fit]]\nmesh = \"walk*.obj\"\n");
  const std::vector<std::string> names{"walk9", "walk10", "walk11", "walk12"};

  RunOptions options;
  options.kill_once = folder / "killed/walk10.status.json";
  REQUIRE(run_command({"batch", "run", manifest, "-o", folder / "killed"}, options).exit_code ==
          128 + SIGKILL);
  REQUIRE(run_command({"batch", "run", manifest, "-o", folder / "killed", "--resume"}).exit_code ==
          0);
  REQUIRE(run_command({"batch", "run", manifest, "-o", folder / "out", "--jobs", "2"}).exit_code ==
          0);
  REQUIRE(run_command({"batch", "run", afresh, "-o", folder / "afresh"}).exit_code == 0);
  const json walked = read_summary(folder / "out"), single = read_summary(folder / "afresh");
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string bytes = map_bytes(folder / "out", names[i]);
    CHECK_FALSE(bytes.empty());
    CHECK(bytes == map_bytes(folder / "killed", names[i]));
    const json figures = walked["entries"][i]["figures"];
    CHECK(walked["entries"][i]["name"] == names[i]);
    CHECK(figures["evaluations"] == (i == 0 ? 400 : 40));
    CHECK(figures["factors"] == 48);
    INFO(names[i] << " " << figures["iou"] << " " << single["entries"][i]["figures"]);
    for (const json& found : single["entries"]) {
      if (found["name"] != names[i]) continue;
      CHECK(found["figures"]["evaluations"] == 400);
      CHECK(figures["iou"].get<double>() > found["figures"]["iou"].get<double>() - 0.02);
    }
    const json map = json::parse(bytes);
    CHECK(map["provenance"]["options"].contains("initial_fnv1a64") == (i > 0));
  }
  // The map says how it was made, and is made so again.
  const std::string again = folder / "again.qjulia.json";
  const ProcessResult rerun = run_command(
      {"run", folder / "out/walk12.qjulia.json", "--inputs", folder.path().string(), "-o", again});
  CAPTURE(rerun.err);
  CHECK(rerun.exit_code == 0);
  const json made = json::parse(read_text(again));
  CHECK(made["factors"] == json::parse(map_bytes(folder / "out", "walk12"))["factors"]);
}

TEST_CASE("frames of a point cache give the maps of files with the same numbers") {
  const TemporaryFolder folder;
  std::vector<qjulia::TriangleMesh> frames(3, qjulia::shapes::sphere(3));
  for (std::size_t frame = 0; frame < frames.size(); ++frame) {
    for (Eigen::Vector3d& v : frames[frame].vertices) {
      v.x() *= 2.5;
      v.z() += 0.4 * std::sin(1.5 * v.x() - 0.25 * static_cast<double>(frame));
    }
    folder.file("walk_000" + std::to_string(frame + 1) + ".obj",
                qjulia::test::obj_text(frames[frame]));
  }
  const std::string faces = faces_text(frames[0]);
  folder.file("walk.npz", saved_cache(vertices_text<double>(frames), faces));
  const std::string defaults = "[defaults]\nfactors = 24\nmax_evaluations = 100\n[[fit]]\n";
  const std::string of_files = folder.file("f.toml", defaults + "sequence = \"walk_*.obj\"\n");
  const std::string of_cache = folder.file("c.toml", defaults + "sequence = \"walk.npz\"\n");
  REQUIRE(run_command({"batch", "run", of_files, "-o", folder / "files"}).exit_code == 0);
  const std::string out = folder / "cache";
  REQUIRE(run_command({"batch", "run", of_cache, "-o", out}).exit_code == 0);
  std::map<std::string, std::filesystem::file_time_type> times;
  for (const std::string name : {"walk_0001", "walk_0002", "walk_0003"}) {
    json mine = json::parse(map_bytes(out, name));
    json theirs = json::parse(map_bytes(folder / "files", name));
    CHECK(mine["provenance"]["mesh"]["name"] == "walk.npz");
    CHECK(mine["provenance"]["mesh"]["frame"] == name.back() - '0');
    CHECK_FALSE(mine["provenance"].contains("jobs"));
    CHECK(mine["provenance"]["stages"] == theirs["provenance"]["stages"]);
    mine.erase("provenance");
    theirs.erase("provenance");
    CHECK(mine == theirs);
    times[name] = std::filesystem::last_write_time(out + "/" + name + ".qjulia.json");
  }

  // A frame that changes is fitted again, and so are those after it. Packed, all is as it was.
  frames[1].vertices[0].x() += 0.01;
  folder.file("walk.npz", packed_cache(vertices_text<double>(frames), faces));
  REQUIRE(run_command({"batch", "run", of_cache, "-o", out, "--resume"}).exit_code == 0);
  for (const auto& [name, time] : times) {
    const bool is_kept = name == "walk_0001";
    CHECK((std::filesystem::last_write_time(out + "/" + name + ".qjulia.json") == time) == is_kept);
  }
  folder.file("walk.npz", saved_cache("no array", faces));
  const ProcessResult refused = run_command({"batch", "run", of_cache, "-o", out});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("c.toml:4: cannot read mesh") &&
                              ContainsSubstring("walk.npz': 'vertices' is no array"));
}

TEST_CASE("an interrupted batch says so and can be resumed") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  const ProcessResult stopped =
      run_command({"batch", "run", manifest, "-o", folder / "out"}, {.interrupt_at = "[1/6]"});
  CHECK(stopped.exit_code == 130);
  CHECK(statuses_done(folder / "out") < 5);
  CHECK(run_command({"batch", "run", manifest, "-o", folder / "out", "--resume"}).exit_code == 1);
  check_five_and_one(folder / "out");

  // The same where all is done again.
  const ProcessResult again =
      run_command({"batch", "run", manifest, "-o", folder / "out"}, {.interrupt_at = "[1/6]"});
  CHECK(again.exit_code == 130);
  CHECK_THAT(again.out + again.err, ContainsSubstring("from an earlier run and not redone"));
  CHECK(statuses_done(folder / "out") >= 3);
}

TEST_CASE("names that are not UTF-8 are written out, and such entries are done once") {
  const TemporaryFolder folder;
  folder.file("h\xFF.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  const std::string manifest = folder.file(
      "m.toml", "[defaults]\nfactors = 24\nmax_evaluations = 40\n[[fit]]\nmesh = \"*.obj\"\n");
  const std::string out = folder / "out";
  CHECK(run_command({"batch", "run", manifest, "-o", out}).exit_code == 0);
  const auto map = std::filesystem::path(out) / "h\\xFF.qjulia.json";
  REQUIRE(std::filesystem::exists(map));
  const auto made = std::filesystem::last_write_time(map);
  CHECK(run_command({"batch", "run", manifest, "-o", out, "--resume"}).exit_code == 0);
  CHECK(std::filesystem::last_write_time(map) == made);
}

TEST_CASE("a folder in use is refused, and the message says by whom") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  const std::string out = folder / "out";
  std::filesystem::create_directory(out);
  // flock(1) holds the lock as another batch would.
  const auto refused = [&](const std::string& more) {
    return qjulia::test::run(
        {"/usr/bin/flock", out + "/.lock", "/bin/bash", "-c",
         "echo '{\"host\": \"h\", \"process\": 7, \"since\": \"now\"}' > \"$1\"/.lock; "
         "\"$0\" batch run \"$2\" -o \"$1\" " +
             more,
         QJULIA_COMMAND, out, manifest});
  };
  for (const char* more : {"", "--resume"}) {
    const ProcessResult result = refused(more);
    CHECK(result.exit_code == 1);
    CHECK_THAT(result.err, ContainsSubstring("in use by process 7 on h since now"));
  }
  CHECK_FALSE(std::filesystem::exists(out + "/batch.json"));
}

TEST_CASE("a mesh that vanishes fails its own entry") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  folder.file("m.toml",
              "[defaults]\nfactors = 24\nmax_evaluations = 40\n[[fit]]\nmesh = "
              "\"ball.obj\"\n[[fit]]\nmesh = \"box.obj\"\n[[fit]]\nmesh = \"torus.obj\"\n");
  const std::string out = folder / "out";
  const ProcessResult first =
      run_command({"batch", "run", manifest, "-o", out}, {.interrupt_at = "[1/3]"});
  CHECK(first.exit_code == 130);
  CHECK(run_command({"batch", "status", out}).exit_code == 1);
  std::filesystem::remove(folder / "ball.obj");   // done
  std::filesystem::remove(folder / "torus.obj");  // not done
  CHECK(run_command({"batch", "run", manifest, "-o", out, "--resume"}).exit_code == 1);
  const json all = read_summary(out);
  CHECK(all["entries"][0]["state"] == "done");
  CHECK(all["entries"][1]["state"] == "done");
  CHECK(all["entries"][2]["state"] == "failed");
  CHECK_THAT(all["entries"][2]["error"].get<std::string>(), ContainsSubstring("torus.obj"));
  const ProcessResult status = run_command({"batch", "status", out});
  CHECK(status.exit_code == 1);
  CHECK_THAT(status.out, ContainsSubstring("2 of 3 done, 1 failed"));
  CHECK(run_command({"batch", "run", manifest, "-o", folder / "new"}).exit_code == 2);
}

TEST_CASE("checks, status and refusals") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  const std::string out = folder / "out";
  const ProcessResult checked = run_command({"batch", "check", manifest});
  CHECK(checked.exit_code == 0);
  CHECK_THAT(checked.out, ContainsSubstring("6 fits"));

  const std::string bad = folder.file(
      "bad.toml",
      "[[fit]]\nmesh = \"box.obj\"\nfactorz = 3\n[[fit]]\nmesh = \"ball.obj\"\nfactors = 1\n");
  const ProcessResult refused = run_command({"batch", "run", bad, "-o", out});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("bad.toml:3: 'factorz' is not known") &&
                              ContainsSubstring("max_evaluations"));
  CHECK_THAT(refused.err, ContainsSubstring("bad.toml:6: factors: 1 is out of range"));
  CHECK_FALSE(std::filesystem::exists(out));
  const std::string kinds = folder.file(
      "kinds.toml",
      "[defaults]\nmax_factors = true\npolish = 3\nschedule = \"\"\nfactors = [24, 48]\n"
      "[[fit]]\nmesh = \"box.obj\"\n");
  CHECK_THAT(
      run_command({"batch", "check", kinds}).err,
      ContainsSubstring("kinds.toml:2: 'max_factors' must be a number or a string, not true") &&
          ContainsSubstring("kinds.toml:3: 'polish' must be true or false") &&
          ContainsSubstring("kinds.toml:4: 'schedule' is empty") &&
          ContainsSubstring("kinds.toml:5: 'factors' must be a number"));
  const std::string both =
      folder.file("both.toml",
                  "[defaults]\nmax_factors = 30\n[[fit]]\nmesh = \"box.obj\"\nfactors = \"auto\"\n"
                  "[[fit]]\nmesh = \"ball.obj\"\nfactors = 24\n");
  const ProcessResult bounded = run_command({"batch", "check", both});
  CHECK_THAT(bounded.err, ContainsSubstring("both.toml:6: max_factors: it bounds the number") &&
                              !ContainsSubstring("both.toml:3"));

  CHECK(run_command({"batch", "status", out, "--jobs", "2"}).exit_code == 2);
  CHECK_THAT(run_command({"batch", "run", manifest, "-o", out, "--retry-failed"}).err,
             ContainsSubstring("--retry-failed requires --resume"));

  CHECK(run_command({"batch", "run", manifest}).exit_code == 2);
  CHECK(run_command({"batch"}).exit_code == 2);
  CHECK(run_command({"batch", "run", folder / "absent.toml", "-o", out}).exit_code == 2);
  CHECK(run_command({"batch", "status", folder / "absent"}).exit_code == 2);
  CHECK(run_command({"batch", "run", manifest, "-o", out, "--retry-failed"}).exit_code == 2);
  CHECK(run_command({"batch", "run", manifest, "-o", out, "--device", "none such"}).exit_code == 3);
  CHECK(run_command({"batch", "run", manifest, "-o", manifest}).exit_code == 1);
  std::filesystem::create_symlink("loop", folder / "loop");
  CHECK_THAT(run_command({"batch", "run", manifest, "-o", folder / "loop"}).err,
             ContainsSubstring("cannot make the folder"));

  const std::string one =
      folder.file("one.toml",
                  "[defaults]\nfactors = 24\nmax_evaluations = 30\npicture = { size = \"64x48\" }\n"
                  "[[fit]]\nmesh = \"box.obj\"\npicture = { look = \"gold\" }\n"
                  "[[fit]]\nmesh = \"ball.obj\"\nreport = true\n");
  const ProcessResult done = run_command({"batch", "run", one, "-o", out, "--json", "--quiet"});
  CHECK(done.exit_code == 0);
  CHECK(done.err.empty());
  CHECK(json::parse(done.out)["entries"].size() == 2);
  CHECK(std::filesystem::exists(out + "/contact_sheet.png"));
  CHECK_THAT(read_text(out + "/ball.report.html"), ContainsSubstring("the set, n = 6") &&
                                                       ContainsSubstring("Hausdorff") &&
                                                       ContainsSubstring("max_evaluations"));
  CHECK_FALSE(std::filesystem::exists(out + "/box.report.html"));
  // Pictures and meshes hold their jobs, which make them again.
  const std::string again = folder / "again.png";
  CHECK(run_command({"run", out + "/box.png", "-o", again}).exit_code == 0);
  CHECK(read_text(again) == read_text(out + "/box.png"));
  const ProcessResult status = run_command({"batch", "status", out});
  CHECK(status.exit_code == 0);
  CHECK_THAT(status.out, ContainsSubstring("2 of 2 done"));
}

TEST_CASE("a sweep that is killed half-way is resumed to a tidy table and a page", "[slow]") {
  const TemporaryFolder folder;
  make_manifest(folder);
  const std::string manifest = folder.file("sweep.toml", R"([[sweep]]
mesh = ["ball.obj", "box.obj", "torus.obj"]
factors = [12, 16]
detail = [0.01, 0.03]
seed = [1, 2]
max_evaluations = 15
compare = [1, 6]
compare_resolution = 16
picture = { size = "32x24" }
)");
  const std::string out = folder / "out";
  const ProcessResult killed =
      run_command({"batch", "run", manifest, "-o", out, "--jobs", "2"}, {.kill_at = "[12/24]"});
  CHECK(killed.exit_code == 128 + SIGKILL);
  CHECK_FALSE(std::filesystem::exists(out + "/summary.csv"));
  const ProcessResult resumed =
      run_command({"batch", "run", manifest, "-o", out, "--jobs", "2", "--resume"});
  CAPTURE(resumed.err);
  REQUIRE(resumed.exit_code == 0);

  // As csv, which pandas reads alike, has it.
  const std::string script = R"(
import csv, json, sys
rows = list(csv.DictReader(open(sys.argv[1] + '/summary.csv', newline='')))
assert len(rows) == 48, len(rows)
keys = {(r['mesh'], r['factors'], r['detail'], r['seed'], r['n']) for r in rows}
assert len(keys) == 48, keys
for r in rows:
    assert None not in r and r['state'] == 'done', r
    assert r['schedule'] and r['precision'] and r['version'], r
    json.load(open(sys.argv[1] + '/' + r['map']))
    assert 0 < float(r['iou']) <= 1 and float(r['roughness']) > 0, r
    assert int(r['limbs']) >= 0 and int(r['warnings']) >= 0, r
    assert float(r['seconds_all']) >= float(r['seconds']) > 0, r
)";
  const ProcessResult read = qjulia::test::run({"/usr/bin/python3", "-c", script, out});
  CAPTURE(read.err);
  CHECK(read.exit_code == 0);
  const std::string page = read_text(out + "/index.html");
  CHECK_THAT(page, ContainsSubstring("src=\"./torus-detail0.03-factors16-seed2.png\"") &&
                       ContainsSubstring("24 of 24 done"));
}

TEST_CASE("shards, of which one is killed and resumed, make the table of the undivided batch") {
  const TemporaryFolder folder;
  std::string fits = "[defaults]\nfactors = 16\nmax_evaluations = 400\n";
  folder.file("ball.obj", obj_text(qjulia::shapes::sphere(2)));
  fits += "[[sweep]]\nmesh = \"ball.obj\"\nseed = [1, 2, 3, 4, 5, 6]\n";
  const std::string manifest = folder.file("m.toml", fits);
  REQUIRE(run_command({"batch", "run", manifest, "-o", folder / "whole"}).exit_code == 0);
  const std::string out = folder / "parts", events = folder / "e.jsonl";
  RunOptions in_array;
  in_array.environment = {{"SLURM_ARRAY_TASK_ID", "2"},
                          {"SLURM_ARRAY_TASK_MIN", "1"},
                          {"SLURM_ARRAY_TASK_MAX", "3"},
                          {"SLURM_ARRAY_TASK_COUNT", "3"}};
  const Arguments second{"batch", "run", manifest, "-o", out, "--events", events};
  for (const char* shard : {"1/3", "3/3"}) {
    CHECK(run_command({"batch", "run", manifest, "-o", out, "--shard", shard}).exit_code == 0);
  }
  const std::string script = folder.file("kill.sh", R"(
(until grep -qs '"done"' "$1"/shard-2-of-3/*.status.json; do sleep 0.01; done; kill -9 $$) &
shift; exec "$@"
)");
  Arguments killed{"/bin/bash", script, out, QJULIA_COMMAND};
  killed.insert(killed.end(), second.begin(), second.end());
  run(killed, in_array);
  CHECK(run_command({"batch", "merge", out}).exit_code == 1);
  Arguments resumed = second;
  resumed.emplace_back("--resume");
  const ProcessResult again = run_command(resumed, in_array);
  CHECK(again.exit_code == 0);
  CHECK_THAT(again.err, ContainsSubstring("shard 2 of 3, as SLURM_ARRAY_TASK_ID says"));
  const ProcessResult merged = run_command({"batch", "merge", out});
  CHECK(merged.exit_code == 0);
  CHECK_THAT(merged.out, ContainsSubstring("6 of 6 done"));
  const auto entries_of = [](const std::string& made) {
    json entries = read_summary(made)["entries"];
    for (json& entry : entries) {
      for (const char* of_run :
           {"seconds", "earlier_seconds", "started", "process", "memory_bytes", "joules"})
        entry.erase(of_run);
      for (const char* time : {"fit_seconds", "kernel_seconds"}) entry["figures"].erase(time);
    }
    return entries;
  };
  CHECK(entries_of(folder / "whole") == entries_of(out));
  for (const json& entry : entries_of(out)) {
    const std::string name = entry["name"];
    CHECK(map_bytes(folder / "whole", name) == map_bytes(out, name));
  }
  CHECK_FALSE(std::filesystem::exists(events));
  std::istringstream lines(read_text(folder / "e-2-of-3.jsonl"));
  std::string line;
  std::map<std::string, int> counts;
  std::set<std::string> started, of_shard;
  while (std::getline(lines, line)) {
    const json event = json::parse(line);
    ++counts[event.at("event").get<std::string>()];
    if (event["event"] == "started") started.insert(event.at("entry").get<std::string>());
  }
  const json summary = read_summary(out + "/shard-2-of-3");
  for (const json& entry : summary["entries"]) {
    of_shard.insert(entry["name"].get<std::string>());
  }
  CHECK(counts["batch_started"] == 2);
  CHECK(counts["batch_ended"] == 1);
  CHECK(started == of_shard);
}
