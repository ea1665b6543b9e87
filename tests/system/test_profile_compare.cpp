/// `qjulia profile compare`, as a gate sees it: exit codes, words and refusals.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "process.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

/// A profile of one kernel, whose runs take `factor` times as long as they once did.
/// @param drift how much of the limit was lost while it was measured.
json made_up(double factor, double drift = 0) {
  std::vector<double> seconds, limits;
  for (int i = 0; i < 8; ++i) {
    seconds.push_back(factor * (0.1 + 0.0001 * ((3 * i) % 8)));
    limits.push_back(5e10 * (1 - drift * i / 8));
  }
  return {{"device", {{"name", "d"}, {"platform", "p"}, {"driver", "1"}}},
          {"layout", "cpu"},
          {"tuning", json::object()},
          {"kernels",
           {{{"kernel", "energy"},
             {"iterations", 4},
             {"samples", 100},
             {"factors", 20},
             {"width", 16},
             {"precision", "single"},
             {"runs", {{"seconds", seconds}, {"fma_per_second", limits}}}}}}};
}

}  // namespace

TEST_CASE("a comparison of profiles ends with the code of what it found") {
  const TemporaryFolder folder;
  const std::string old = folder.file("old.json", made_up(1).dump());
  const auto compared = [&](const json& now, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"profile", "compare", old,
                                      folder.file("new.json", now.dump())};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  CHECK(compared(made_up(1)).exit_code == 0);
  const ProcessResult faster = compared(made_up(0.9), {"--json"});
  CHECK(faster.exit_code == 0);
  CHECK(json::parse(faster.out)["verdict"] == "faster");
  CHECK(json::parse(faster.out)["kernels"][0]["ratio"].get<double>() ==
        Catch::Approx(0.9).epsilon(0.01));
  const ProcessResult slower = compared(made_up(1.05));
  CHECK(slower.exit_code == 1);
  CHECK_THAT(slower.out, ContainsSubstring("energy") && ContainsSubstring("1.050") &&
                             ContainsSubstring("slower"));
  const ProcessResult busy = compared(made_up(1.3, 0.4));
  CHECK(busy.exit_code == 4);
  CHECK_THAT(busy.err, ContainsSubstring("the machine was busy") &&
                           ContainsSubstring("while NEW was measured"));

  json other = made_up(1);
  other["device"]["driver"] = "2";
  other["layout"] = "gpu";
  const ProcessResult refused = compared(other);
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err,
             ContainsSubstring("driver: 1 in OLD, 2 in NEW") && ContainsSubstring("layout"));
  const ProcessResult shown = compared(other, {"--across-devices"});
  CHECK(shown.exit_code == 0);
  CHECK_THAT(shown.err, ContainsSubstring("differs: driver: 1 in OLD, 2 in NEW"));
  CHECK(compared(other, {"--across-drivers"}).exit_code == 2);
  other["layout"] = "cpu";
  const ProcessResult drivers = compared(other, {"--across-drivers", "--json"});
  CHECK(drivers.exit_code == 0);
  CHECK(json::parse(drivers.out)["between"] == "drivers");
  CHECK_THAT(drivers.err, ContainsSubstring("differs: driver: 1 in OLD, 2 in NEW") &&
                              ContainsSubstring("compared as drivers of one machine"));
}

TEST_CASE("a comparison of profiles refuses what it has no use for") {
  const TemporaryFolder folder;
  const std::string good = folder.file("good.json", made_up(1).dump());
  const std::string text = folder.file("text.json", "no");
  const auto refused = [](const std::vector<std::string>& words, const std::string& why) {
    std::vector<std::string> all = {"profile"};
    all.insert(all.end(), words.begin(), words.end());
    const ProcessResult result = run_command(all);
    CAPTURE(result.err);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.err, ContainsSubstring(why));
  };
  refused({"contrast", good, good}, "its commands are measure, compare,");
  refused({"compare"}, "OLD is required");
  refused({"compare", good}, "NEW is required");
  refused({"compare", good, text}, "NEW '" + text + "' is not JSON");
  refused({"compare", folder / "absent.json", good}, "absent.json");
  refused({"compare", good, good, "--confidence", "1"}, "--confidence");
  refused({"compare", good, good, "--repeats", "9"}, "there is no option '--repeats'");
  refused({"compare", good, good, "--layout", "cpu"}, "there is no option '--layout'");
  refused({"measure", "--across-devices"}, "there is no option '--across-devices'");
}

TEST_CASE("a build that cannot be profiled ends profile against with its own exit code") {
  const TemporaryFolder folder;
  const auto against = [&](int code) {
    const std::string other = folder.file(
        "other", "#!/bin/sh\necho 'qjulia: it failed' >&2\nexit " + std::to_string(code) + "\n");
    std::filesystem::permissions(other, std::filesystem::perms::owner_all);
    return run_command({"profile", "against", other, "--time-limit", "5"});
  };
  for (const int code : {1, 2, 3}) {
    const ProcessResult found = against(code);
    CHECK(found.exit_code == code);
    CHECK_THAT(found.err, ContainsSubstring("it failed"));
  }
  CHECK(against(7).exit_code == 2);
  CHECK(against(130).exit_code == 130);
  const ProcessResult silent = against(0);
  CHECK(silent.exit_code == 2);
  CHECK_THAT(silent.err, ContainsSubstring("printed no profile"));
}

TEST_CASE("profile against says when there is no time for enough rounds, and what helps") {
  const ProcessResult found = run_command(
      {"profile", "against", QJULIA_COMMAND, "--time-limit", "0.1", "--kernels", "energy",
       "--sample-points", "500", "--factors", "16", "--repeats", "1", "--device", "cpu", "--json"});
  INFO(found.err);
  CHECK(found.exit_code == 4);
  const json report = json::parse(found.out);
  CHECK(report["rounds"] == 1);
  CHECK(report["least_rounds"].get<int>() > 1);
  for (const json& kernel : report["kernels"]) {
    CHECK(kernel["verdict"] == "undecided");
    CHECK(kernel["ratio"].is_null());
    CHECK(kernel["before_seconds"].get<double>() > 0);
  }
  CHECK_THAT(found.err, ContainsSubstring("too little data") &&
                            ContainsSubstring("give --time-limit") &&
                            ContainsSubstring("enough for 1;"));
}
