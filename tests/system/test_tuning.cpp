/// profile tune, and what other commands make of it.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "obj_text.hpp"
#include "process.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

using Environment = std::map<std::string, std::string>;

/// A folder that settings are kept in, and commands that see it.
struct Cache {
  TemporaryFolder folder;

  ProcessResult run(std::vector<std::string> arguments, const Environment& more = {}) const {
    RunOptions options;
    options.environment = more;
    options.environment["XDG_CACHE_HOME"] = folder.path().string();
    arguments.insert(arguments.end(), {"--device", "cpu"});
    return run_command(arguments, options);
  }
  ProcessResult tune(const Environment& more = {}) const {
    return run({"profile", "tune", "--json", "--sample-points", "2000", "--factors", "24",
                "--repeats", "1"},
               more);
  }
  json profile(const Environment& more = {}) const {
    const ProcessResult result = run({"profile", "measure", "--json", "--sample-points", "500",
                                      "--factors", "16", "--repeats", "1"},
                                     more);
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return json::parse(result.out);
  }
  /// Settings as 'profile tune' keeps them, with a lane width that is not the default.
  std::string retuned() const {
    const std::string file = folder / "settings.json";
    const auto kept = [&](const char* command) {
      const ProcessResult result = run({"profile", command, file, "--json"});
      INFO(result.err);
      REQUIRE(result.exit_code == 0);
      return json::parse(result.out)["file"].get<std::string>();
    };
    kept("export");
    json settings = json::parse(read_text(file));
    settings["single"]["lane_width"] = 8;
    settings["single"]["energy_vectors"] = 3;
    std::ofstream(file) << settings;
    return kept("import");
  }
};

}  // namespace

TEST_CASE("profile tune tries settings, and changes none when it cannot be certain") {
  const Cache cache;
  const std::string file = cache.retuned(), before = read_text(file);
  const ProcessResult result = cache.tune();
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  const json report = json::parse(result.out);
  CHECK(report["trials"].size() >= 10);
  CHECK(report["tolerance"] == 1e-4);
  CHECK(report["file"] == file);
  CHECK(std::filesystem::path(file).parent_path() == cache.folder.path() / "qjulia");
  CHECK(report["before"]["lane_width"] == 8);
  CHECK(report["tuning"] == report["before"]);  // one run of each is too little
  CHECK(report["why_kept"].is_string());
  CHECK(read_text(file) == before);
  CHECK(cache.profile()["tuning"] == report["tuning"]);
}

TEST_CASE("profile and fit say that settings are tuned, and QJULIA_TUNING=off that they are not",
          "[slow]") {
  const Cache cache;
  cache.retuned();
  const json tuned = cache.profile();
  CHECK(tuned["tuned"] == true);
  CHECK(tuned["kernels"][0]["width"] == 8);
  const json untuned = cache.profile({{"QJULIA_TUNING", "off"}});
  CHECK(untuned["tuned"] == false);
  CHECK(untuned["tuning"]["energy_vectors"] == 4);
  const ProcessResult told = cache.run(
      {"profile", "measure", "--sample-points", "500", "--factors", "16", "--repeats", "1"});
  CHECK_THAT(told.out, ContainsSubstring("settings: tuned"));
  CHECK_THAT(told.err, ContainsSubstring("(tuned)"));

  const auto mesh = cache.folder.file(
      "torus.obj", qjulia::test::obj_text(qjulia::shapes::torus(1, 0.45, 32, 16)));
  const std::string map = cache.folder / "torus.qjulia.json";
  REQUIRE(
      cache.run({"fit", mesh, "-o", map, "--factors", "16", "--max-evaluations", "5"}).exit_code ==
      0);
  CHECK(json::parse(read_text(map))["provenance"]["device"]["tuning"]["energy_vectors"] == 3);
}

TEST_CASE("QJULIA_TUNING is checked") {
  const Cache cache;
  for (const char* word : {"of", "0", "no"}) {
    const ProcessResult refused = cache.run({"doctor"}, {{"QJULIA_TUNING", word}});
    CHECK(refused.exit_code == 2);
    CHECK_THAT(refused.err,
               ContainsSubstring("QJULIA_TUNING is '" + std::string(word) + "'; give on"));
  }
}

TEST_CASE("corrupt settings are passed over with a warning") {
  const Cache cache;
  const std::string file = cache.retuned();
  std::filesystem::resize_file(file, 50);
  const ProcessResult result = cache.run({"profile", "measure", "--json", "--sample-points", "500",
                                          "--factors", "16", "--repeats", "1"});
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.err, ContainsSubstring(file) && ContainsSubstring("tune this device again"));
  CHECK(json::parse(result.out)["tuned"] == false);
}

TEST_CASE("settings with wrong results are refused and not timed") {
  const Cache cache;
  const ProcessResult result =
      cache.tune({{"LD_PRELOAD", QJULIA_FAULTY_OPENCL},
                  {"QJULIA_TEST_WRONG_WIDTH", "1"},
                  {"ASAN_OPTIONS", "detect_leaks=0:verify_asan_link_order=0"}});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  bool met = false;
  const json report = json::parse(result.out);
  for (const json& trial : report["trials"]) {
    if (trial["setting"] != "lane_width") continue;
    if (trial["value"] != 1) {
      CHECK(trial["difference"].get<double>() <= 1e-4);
      continue;
    }
    met = true;
    CHECK(trial["refused"] == "its results differ");
    CHECK(trial["time_ratio"].is_null());
    CHECK(trial["taken"] == false);
  }
  CHECK(met);
}

TEST_CASE("profile tune takes no option of other measurements") {
  const Cache cache;
  CHECK(cache.run({"profile", "tune", "--lane-width", "8"}).exit_code == 2);
  CHECK(cache.run({"profile", "tune", "--csv", cache.folder / "a.csv"}).exit_code == 2);
  CHECK(cache.run({"profile", "measure", "--csv", cache.folder / "a.txt"}).exit_code == 2);
  CHECK(cache.run({"profile", "export", cache.folder / "a.txt"}).exit_code == 2);
  CHECK(cache.run({"profile", "grid"}).exit_code == 2);
}

TEST_CASE("options that commands have replaced are refused with the command") {
  const auto said = [](const std::vector<std::string>& words) {
    const ProcessResult result = run_command(words);
    CHECK(result.exit_code == 2);
    return result.err;
  };
  CHECK_THAT(said({"profile", "--tune"}), ContainsSubstring("'qjulia profile tune' now"));
  CHECK_THAT(said({"profile", "--grid=panel_block=32"}),
             ContainsSubstring("'qjulia profile grid' now"));
  CHECK_THAT(said({"doctor", "--matrix"}), ContainsSubstring("'qjulia doctor matrix' now"));
  CHECK_THAT(said({"doctor", "--json", "--matrix"}),
             ContainsSubstring("'qjulia doctor matrix' now"));
  CHECK_THAT(said({"profile", "measure", "--tune"}),
             ContainsSubstring("'qjulia profile tune' now"));
  CHECK_THAT(said({"profile", "measure", "--json=banana"}),
             ContainsSubstring("--json takes no value; leave out '=banana'"));
  CHECK_THAT(said({"batch", "--status", "out"}), ContainsSubstring("'qjulia batch status' now"));
  CHECK_THAT(said({"batch", "m.toml", "-o", "out"}),
             ContainsSubstring("needs one of its commands before 'm.toml'; its commands are run"));
  CHECK_THAT(said({"profile", "compere", "a.json"}), ContainsSubstring("did you mean 'compare'?"));
  CHECK_THAT(said({"profile"}), ContainsSubstring("measure") && ContainsSubstring("against"));
}
