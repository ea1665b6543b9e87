/// What the command answers before any work: help, version, usage, devices.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "process.hpp"
#include "qjulia/base/version.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::StartsWith;
using qjulia::test::run_command;

TEST_CASE("--help teaches and --version tells, on standard output") {
  const auto help = run_command({"--help"});
  CHECK(help.exit_code == 0);
  CHECK_THAT(help.out, ContainsSubstring("First steps") && ContainsSubstring("Exit codes"));
  const auto version = run_command({"--version"});
  CHECK(version.exit_code == 0);
  CHECK_THAT(version.out, StartsWith(std::string("qjulia ") + qjulia::version() + "\nbuilt by ") &&
                              ContainsSubstring("OpenCL headers") && ContainsSubstring("libpng"));
  for (const char* command :
       {"devices", "fit", "surface", "render", "sample", "compare", "convert", "info"}) {
    CAPTURE(command);
    const auto result = run_command({command, "--help"});
    CHECK(result.exit_code == 0);
    CHECK_THAT(result.out, ContainsSubstring("Example") && ContainsSubstring("--json"));
    CHECK_THAT(help.out, ContainsSubstring(command));
  }
}

TEST_CASE("--help names the map options, --help-all and 'help COMMAND' explain them") {
  const auto brief = run_command({"render", "--help"});
  CHECK_THAT(brief.out, ContainsSubstring("--order-seed") && !ContainsSubstring("Shuffles"));
  CHECK(brief.out.find("Examples") < brief.out.find("Options"));
  const auto all = run_command({"render", "--help-all"});
  CHECK(all.exit_code == 0);
  CHECK_THAT(all.out, ContainsSubstring("Shuffles"));
  CHECK(run_command({"help", "render"}).out == all.out);
  CHECK(run_command({"help"}).out == run_command({"--help"}).out);
}

TEST_CASE("bad usage is exit code 2 and names what was wrong") {
  CHECK(run_command({}).exit_code == 2);
  const auto command = run_command({"frobnicate"});
  CHECK(command.exit_code == 2);
  CHECK_THAT(command.err, ContainsSubstring("frobnicate") && !ContainsSubstring("did you mean"));
  CHECK_THAT(run_command({"surfcae"}).err, ContainsSubstring("did you mean 'surface'?"));
  const auto mistyped = run_command({"surface", "map.json", "--detial", "0.02"});
  CHECK(mistyped.exit_code == 2);
  CHECK_THAT(mistyped.err,
             ContainsSubstring("there is no option '--detial'; did you mean '--detail'?") &&
                 ContainsSubstring("qjulia surface --help-all") && !ContainsSubstring("0.02"));
  CHECK_THAT(run_command({"surface", "map.json", "--frobnicate=1"}).err,
             ContainsSubstring("'--frobnicate';") && !ContainsSubstring("did you mean"));
  const auto option = run_command({"devices", "--frobnicate"});
  CHECK(option.exit_code == 2);
  CHECK_THAT(option.err, ContainsSubstring("--frobnicate"));
  const auto missing = run_command({"paint", "map.json"});
  CHECK(missing.exit_code == 2);
  CHECK_THAT(missing.err, ContainsSubstring("--output"));
  CHECK(missing.out.empty());
}

TEST_CASE("devices are listed, and the chosen one is among them") {
  const auto result = run_command({"devices", "--json"});
  REQUIRE(result.exit_code == 0);
  const auto listed = nlohmann::json::parse(result.out);
  bool found = false;
  for (const auto& device : listed["devices"]) found = found || device["id"] == listed["chosen"];
  CHECK(found);
  CHECK_THAT(run_command({"devices"}).out,
             ContainsSubstring("* " + listed["chosen"].get<std::string>()));
  const auto verbose = run_command({"devices", "--verbose"});
  CHECK_THAT(verbose.out, ContainsSubstring("local memory"));
}

TEST_CASE("a device nobody has is exit code 3, never a fallback") {
  const qjulia::test::TemporaryFolder folder;
  const auto named = run_command({"devices", "--device", "no such device"});
  CHECK(named.exit_code == 3);
  CHECK_THAT(named.err, ContainsSubstring("no such device"));
  const auto chosen = run_command({"devices"}, {.environment = {{"QJULIA_DEVICE", "7:7"}}});
  CHECK(chosen.exit_code == 3);
  CHECK_THAT(chosen.err, ContainsSubstring("7:7"));
  const auto none = run_command({"devices"}, {.environment = {{"OCL_ICD_VENDORS", folder / ""}}});
  CHECK(none.exit_code == 3);
  CHECK_THAT(none.err, ContainsSubstring("pocl-opencl-icd"));
}

TEST_CASE("what hides the devices is named") {
  const auto unwritable =
      run_command({"devices"}, {.environment = {{"POCL_CACHE_DIR", "/proc/x"}}});
  CHECK(unwritable.exit_code == 3);
  CHECK_THAT(unwritable.err, ContainsSubstring("/proc/x") && ContainsSubstring("POCL_CACHE_DIR"));
  CHECK_THAT(unwritable.err, !ContainsSubstring("install") && !ContainsSubstring("container"));
  const qjulia::test::TemporaryFolder folder;
  const auto icd = folder.file("absent.icd", "libno-such-driver.so.1\n");
  const auto absent =
      run_command({"devices"}, {.environment = {{"OCL_ICD_VENDORS", folder.path()}}});
  CHECK(absent.exit_code == 3);
  CHECK_THAT(absent.err, ContainsSubstring(icd) && ContainsSubstring("libno-such-driver.so.1") &&
                             !ContainsSubstring("container"));
#ifndef __SANITIZE_ADDRESS__  // which needs terabytes of address space
  const auto memory = qjulia::test::run(
      {"/bin/bash", "-c", "ulimit -v 100000; exec \"$0\" devices", QJULIA_COMMAND});
  CHECK(memory.exit_code == 3);
  CHECK_THAT(memory.err, ContainsSubstring("97 MiB of address space"));
  // In 400,000 KiB PoCL ends the process, in 500,000 it waits for ever.
  const std::string map = QJULIA_TEST_DATA "/../../docs/maps/quadratic.qjulia.json";
  for (const auto& [limit, shown] :
       {std::pair{"200000", "195"}, {"400000", "390"}, {"500000", "488"}}) {
    CAPTURE(limit);
    const std::string script = std::string("ulimit -v ") + limit + "; exec \"$0\" \"$@\"";
    const std::string expected = std::string("only ") + shown + " MiB of address space";
    const auto none = qjulia::test::run({"/bin/bash", "-c", script, QJULIA_COMMAND, "devices"});
    CHECK(none.exit_code == 3);
    CHECK_THAT(none.err, ContainsSubstring(expected));
    const auto some = qjulia::test::run({"/bin/bash", "-c", script, QJULIA_COMMAND, "info", map});
    CHECK(some.exit_code == 0);
    CHECK_THAT(some.out, ContainsSubstring(expected));
  }
#endif
}

TEST_CASE("help that cannot be written is exit code 1") {
  for (const char* words : {"--help", "--version", "help", "render --help-all", "devices"}) {
    CAPTURE(words);
    const auto lost = qjulia::test::run(
        {"/bin/bash", "-c", std::string("exec \"$0\" ") + words + " > /dev/full", QJULIA_COMMAND});
    CHECK(lost.exit_code == 1);
    CHECK_THAT(lost.err, ContainsSubstring("cannot write to standard output: No space left"));
  }
}

TEST_CASE("a relative folder for caches is ignored, by drivers too") {
  const qjulia::test::TemporaryFolder folder;
  const auto made = qjulia::test::run(
      {"/bin/bash", "-c",
       "cd \"$1\" && mkdir home && unset POCL_CACHE_DIR && HOME=$PWD/home XDG_CACHE_HOME=cache "
       "exec \"$0\" sample \"$2\" -o field.npy --resolution 4 --device cpu",
       QJULIA_COMMAND, folder.path().string(),
       QJULIA_TEST_DATA "/../../docs/maps/quadratic.qjulia.json"});
  INFO(made.err);
  CHECK(made.exit_code == 0);
  CHECK(std::filesystem::exists(folder / "field.npy"));
  CHECK_FALSE(std::filesystem::exists(folder / "cache"));
  CHECK_FALSE(std::filesystem::is_empty(folder / "home/.cache"));
}
