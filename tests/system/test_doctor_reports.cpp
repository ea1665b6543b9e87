/// Reports of `qjulia doctor`: what they hold, PoCL's settings in turns, JUnit, and two compared.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "process.hpp"
#include "temporary_folder.hpp"
#include "wrong_compilers.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

using Environment = std::map<std::string, std::string>;

/// doctor on the CPU, for one small program.
ProcessResult doctor(const std::vector<std::string>& more, const Environment& environment = {},
                     const char* command = "check") {
  std::vector<std::string> words = {"doctor", command, "--device", "cpu", "--programs", "reduce.*"};
  words.insert(words.end(), more.begin(), more.end());
  RunOptions options;
  options.environment = environment;
  return run_command(words, options);
}

/// A device on which the program does not build.
const Environment kBroken{{"LD_PRELOAD", QJULIA_FAULTY_OPENCL},
                          {"QJULIA_TEST_BROKEN_PROGRAM", "reduce.cl"},
                          {"ASAN_OPTIONS", "detect_leaks=0:verify_asan_link_order=0"}};

/// The precisions in which a compiler that is wrong on purpose does not pass.
std::set<std::string> caught(std::string_view compiler) {
  const ProcessResult found =
      run_command({"doctor", "--device", "cpu", "--programs", "builtins.cl", "--json"},
                  {.environment = {{"LD_PRELOAD", QJULIA_FAULTY_OPENCL},
                                   {"QJULIA_TEST_WRONG_COMPILER", std::string(compiler)},
                                   {"ASAN_OPTIONS", "detect_leaks=0:verify_asan_link_order=0"}}});
  INFO(found.err);
  std::set<std::string> precisions;
  const json report = json::parse(found.out);
  for (const json& program : report["programs"]) {
    CHECK(program["built"] == true);
    if (program["passed"] == false) precisions.insert(program["precision"]);
  }
  return precisions;
}

json check(const char* program, bool passed, const json& difference) {
  return {{"program", program}, {"precision", "single"},    {"passed", passed},
          {"compared", "sums"}, {"difference", difference}, {"tolerance", 0.5},
          {"problem", json()}};
}

/// A report as doctor makes it of these checks.
json made_up(const std::vector<json>& checks) {
  return {
      {"program", "qjulia"},      {"device", {{"name", "d"}, {"platform", "p"}, {"driver", "1"}}},
      {"layout", "cpu"},          {"driver", {{"llvm", "15"}, {"environment", json::object()}}},
      {"tuning", json::object()}, {"programs", checks}};
}

}  // namespace

TEST_CASE("doctor reports versions, flags and variables, of the programs that are named") {
  const ProcessResult found =
      doctor({"--json"}, {{"POCL_EXTRA_BUILD_FLAGS", "-DQJ_NOTHING=1"}, {"LP_NOTHING", "2"}});
  CAPTURE(found.err);
  REQUIRE(found.exit_code == 0);
  const json report = json::parse(found.out);
  REQUIRE(report["programs"].size() == 2);  // in both precisions
  for (const json& program : report["programs"]) {
    CHECK(program["program"] == "reduce.cl");
    CHECK(program["seconds"].get<double>() > 0);
  }
  const json& driver = report["driver"];
  CHECK_THAT(driver["platform_version"].get<std::string>(),
             ContainsSubstring("PoCL " + driver["pocl"].get<std::string>()) &&
                 ContainsSubstring("LLVM " + driver["llvm"].get<std::string>()));
  CHECK_THAT(driver["build_flags"]["double"].get<std::string>(),
             ContainsSubstring("-cl-std=CL1.2") && ContainsSubstring("-DQJ_DOUBLE=1"));
  CHECK(driver["extra_build_flags"] == "-DQJ_NOTHING=1");
  CHECK(driver["environment"]["POCL_EXTRA_BUILD_FLAGS"] == "-DQJ_NOTHING=1");
  CHECK(driver["environment"]["LP_NOTHING"] == "2");
  CHECK_FALSE(driver["environment"].contains("PATH"));
  CHECK_FALSE(driver["environment"].contains("QJULIA_CRASHED_BUILDS"));  // doctor's own

  const ProcessResult none = run_command({"doctor", "--device", "cpu", "--programs", "none.cl"});
  CHECK(none.exit_code == 2);
  CHECK_THAT(none.err, ContainsSubstring("no check has a name like 'none.cl'"));
}

TEST_CASE("doctor says which layout does without barriers because of the driver") {
  for (const std::string version : {"3.1", "6.0"}) {
    for (const std::string layout : {"cpu", "gpu"}) {
      CAPTURE(version, layout);
      const ProcessResult found =
          doctor({"--layout", layout, "--json"},
                 {{"LD_PRELOAD", QJULIA_FAULTY_OPENCL},
                  {"QJULIA_TEST_DRIVER_VERSION", version},
                  {"ASAN_OPTIONS", "detect_leaks=0:verify_asan_link_order=0"}});
      INFO(found.err);
      REQUIRE(found.exit_code == 0);
      const json report = json::parse(found.out);
      CHECK(report["driver"]["may_miscompile_barriers"] == (version == "6.0"));
      const auto says = [](const json& finding) { return finding["kind"] == "barriers"; };
      CHECK(std::ranges::any_of(report["findings"], says) == (version == "6.0" && layout == "gpu"));
      const int group = version == "3.1" && layout == "gpu" ? 64 : 1;
      CHECK(report["tuning"]["double"]["orbit_group"] == group);
    }
  }
}

TEST_CASE("doctor's JUnit calls a program that does not build an error") {
  const TemporaryFolder folder;
  const std::string file = folder / "doctor.xml";
  CHECK(doctor({"--junit", file}).exit_code == 0);
  CHECK_THAT(read_text(file),
             ContainsSubstring("<testsuites name=\"qjulia doctor\" tests=\"2\" failures=\"0\" "
                               "errors=\"0\"") &&
                 ContainsSubstring("name=\"reduce.cl (double)\""));
  const ProcessResult broken = doctor({"--junit", file}, kBroken);
  CHECK(broken.exit_code == 1);
  CHECK_THAT(read_text(file), ContainsSubstring("failures=\"0\" errors=\"2\"") &&
                                  ContainsSubstring("<error message=\"reduce.cl did not build"));
  CHECK(doctor({"--junit", folder / "doctor.txt"}).exit_code == 2);
}

TEST_CASE("doctor goes through PoCL's settings, each in a process of its own") {
  const TemporaryFolder folder;
  const std::string junit = folder / "doctor.xml";
  const Environment mine{{"TMPDIR", folder.path().string()}, {"POCL_CACHE_DIR", folder / "cache"}};
  const ProcessResult found = doctor({"--junit", junit, "--json"}, mine, "matrix");
  CAPTURE(found.err);
  REQUIRE(found.exit_code == 0);
  const json settings = json::parse(found.out)["settings"];
  REQUIRE(settings.size() == 8);
  for (const json& setting : settings) {
    CAPTURE(setting["name"]);
    CHECK(setting["passed"] == true);
    const json& report = setting["report"];
    CHECK(report["programs"].size() == 2);
    CHECK(report["builds"]["compiled"] == 2);
    for (const auto& [name, value] : setting["environment"].items()) {
      CHECK(report["driver"]["environment"][name] == value);
    }
    const bool has_one_thread = setting["name"] == "one thread";
    if (has_one_thread) CHECK(report["device"]["compute_units"] == 1);
    // Drivers may refuse the name of a method.
    if (!setting["environment"].contains("POCL_WORK_GROUP_METHOD")) CHECK(setting["known"] == true);
    CHECK_THAT(read_text(junit),
               ContainsSubstring("<testsuite name=\"" + setting["name"].get<std::string>() + "\""));
  }
  // The caches of the settings are gone.
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    CHECK_THAT(entry.path().filename().string(), !ContainsSubstring("qjulia-doctor"));
  }
}

TEST_CASE("a setting under which a program fails is named") {
  const ProcessResult broken = doctor({}, kBroken, "matrix");
  CHECK(broken.exit_code == 1);
  CHECK_THAT(broken.out, ContainsSubstring("FAILED loopvec: reduce.cl single: reduce.cl did not "
                                           "build") &&
                             ContainsSubstring("not every program works"));
}

TEST_CASE("doctor catches compilers that are wrong on purpose") {
  for (const char* compiler : {"fmax-fmin", "shuffle", "barrier"}) {
    CAPTURE(compiler);
    CHECK(caught(compiler) == std::set<std::string>{"single", "double"});
  }
}

TEST_CASE("doctor catches every compiler that is wrong on purpose", "[slow]") {
  const std::set<std::string> both{"single", "double"}, only_double{"double"};
  for (const WrongCompiler& compiler : kWrongCompilers) {
    CAPTURE(compiler.name);
    const auto& name = compiler.name;
    // Devices may lack small numbers in single precision, and no kernel has a volatile.
    const bool is_of_doubles = name == "denormals" || name == "double-sqrt";
    CHECK(caught(name) == (name == "volatile" ? std::set<std::string>{}
                           : is_of_doubles    ? only_double
                                              : both));
  }
}

TEST_CASE("two reports of doctor are compared, and what got worse decides") {
  const TemporaryFolder folder;
  const json old = made_up({check("a.cl", true, 0.25), check("b.cl", true, 0.125),
                            check("c.cl", false, 3.0), check("d.cl", true, 0.0)});
  const auto compared = [&](const json& a, const json& b,
                            const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"doctor", "compare", folder.file("a.json", a.dump()),
                                      folder.file("b.json", b.dump())};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  const ProcessResult same = compared(old, old);
  CHECK(same.exit_code == 0);
  CHECK_THAT(same.out, ContainsSubstring("0 checks worse, 0 better") &&
                           ContainsSubstring("4 the same") && !ContainsSubstring("differs:"));

  json now = made_up({check("a.cl", true, 0.25), check("b.cl", true, 0.126),
                      check("c.cl", true, 0.4), check("e.cl", true, 0.0)});
  now["device"]["driver"] = "2";
  now["driver"]["environment"]["POCL_X"] = "1";
  const ProcessResult worse = compared(old, now, {"--json"});
  CHECK(worse.exit_code == 1);  // d.cl is gone
  const json found = json::parse(worse.out);
  CHECK(found["passed"] == false);
  CHECK(found["counts"] == json({{"worse", 1}, {"better", 2}, {"result", 1}, {"same", 1}}));
  CHECK(found["differences"] ==
        json({"device.driver: 1 in A, 2 in B", "driver.environment.POCL_X: nothing in A, 1 in B"}));
  CHECK(found["programs"][1] == json({{"setting", json()},
                                      {"program", "b.cl"},
                                      {"precision", "single"},
                                      {"before", "passed"},
                                      {"after", "passed"},
                                      {"before_difference", 0.125},
                                      {"after_difference", 0.126},
                                      {"change", "result"}}));
  CHECK(found["programs"][3]["after"] == "absent");
  CHECK(compared(now, made_up({check("a.cl", true, 0.25), check("b.cl", true, 0.126),
                               check("c.cl", true, 0.4), check("e.cl", true, 0.0)}))
            .exit_code == 0);

  // In a matrix, each setting's checks have rows of their own.
  json matrix = old;
  matrix.erase("programs");
  matrix["settings"] = {{{"name", "cbs"}, {"report", old}}, {{"name", "dead"}, {"report", json()}}};
  json other = matrix;
  other["settings"][0]["report"] = now;
  const ProcessResult rows = compared(matrix, other);
  CHECK(rows.exit_code == 1);
  CHECK_THAT(rows.out, ContainsSubstring("cbs: ") && ContainsSubstring("absent in B"));

  CHECK_THAT(compared(old, matrix).err, ContainsSubstring("made by 'doctor matrix'"));
  const ProcessResult alien = compared(old, json::array());
  CHECK(alien.exit_code == 2);
  CHECK_THAT(alien.err, ContainsSubstring("B is not a report"));
  CHECK_THAT(run_command({"doctor", "compare", "one.json"}).err,
             ContainsSubstring("B is required"));
  CHECK_THAT(run_command({"doctor", "contrast"}).err,
             ContainsSubstring("its commands are check, matrix, compare"));
  CHECK_THAT(compared(old, old, {"--junit", "x.xml"}).err,
             ContainsSubstring("no option '--junit'"));
}
