/// Outputs on a disk that is too small for them: exit code 1, a message, no file left.

#include <catch2/catch_all.hpp>

#include "obj_text.hpp"
#include "process.hpp"
#include "qjulia/map/map_file.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using qjulia::test::run;
using qjulia::test::TemporaryFolder;
using Arguments = std::vector<std::string>;

namespace {

/// The command with its output on a disk of `kilobytes`, a mount that only the command and the
/// shell around it see. Standard output ends in the names of the files that are left.
/// @param environment settings for `env`, such as A=b
qjulia::test::ProcessResult run_on_small_disk(const Arguments& arguments, const std::string& disk,
                                              int kilobytes, const Arguments& environment = {}) {
  const std::string script = "mount -t tmpfs -o size=" + std::to_string(kilobytes) +
                             "k tmpfs \"$1\" || exit 99; ls=\"$1\"; shift; \"$@\"; code=$?; "
                             "ls -A \"$ls\"; exit $code";
  Arguments command = {
      "/usr/bin/unshare", "--map-root-user", "--mount", "/bin/bash", "-c", script, "bash", disk,
      "/usr/bin/env"};
  command.insert(command.end(), environment.begin(), environment.end());
  command.emplace_back(QJULIA_COMMAND);
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run(command);
}

void check_nothing_left(Arguments arguments, const std::string& name, int kilobytes) {
  const TemporaryFolder folder;
  arguments.insert(arguments.end(), {"-o", folder / name, "--device", "cpu"});
  // That the disk is large enough is all that makes the difference.
  const auto whole = run_on_small_disk(arguments, folder / "", 1 << 16);
  CAPTURE(arguments, whole.err);
  REQUIRE(whole.exit_code == 0);
  CHECK(whole.out == name + "\n");
  const auto result = run_on_small_disk(arguments, folder / "", kilobytes);
  CAPTURE(result.err);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.err, ContainsSubstring("cannot write") && ContainsSubstring(name));
  CHECK(result.out.empty());
}

}  // namespace

TEST_CASE("a full disk leaves nothing half-written") {
  const TemporaryFolder folder;
  const std::string map = folder / "ball.qjulia.json";
  qjulia::Map ball;
  ball.dynamics.factors = {{{}, 3}};
  ball.frame.box = qjulia::Box{{-1, -1, -1}, {1, 1, 1}};
  qjulia::write_map(ball, map);
  const std::string mesh =
      folder.file("ball.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  check_nothing_left({"sample", map, "--resolution", "32"}, "ball.npy", 64);
  check_nothing_left({"sample", map, "--resolution", "32"}, "ball.vti", 64);
  check_nothing_left({"surface", map, "--resolution", "48"}, "ball.ply", 64);
  check_nothing_left({"surface", map, "--resolution", "48"}, "ball.obj", 64);
  check_nothing_left({"render", map, "--size", "160x120", "--samples", "1"}, "ball.png", 4);
  check_nothing_left({"fit", mesh, "--factors", "24", "--max-evaluations", "3"},
                     "fitted.qjulia.json", 4);
}

TEST_CASE("a message about a full disk names the driver's cache and the variable that moves it") {
  const TemporaryFolder folder, results;
  const auto result =
      run_on_small_disk({"sample", QJULIA_TEST_DATA "/../../docs/maps/quadratic.qjulia.json", "-o",
                         results / "field.npy", "--resolution", "4", "--device", "cpu"},
                        folder / "", 64, {"POCL_CACHE_DIR=" + (folder / "")});
  CAPTURE(result.err);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.err, ContainsSubstring("is full") &&
                             ContainsSubstring("'" + (folder / "") + "' (from POCL_CACHE_DIR)"));
}
