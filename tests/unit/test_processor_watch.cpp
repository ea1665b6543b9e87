/// Who else has the processors, of files made up as Linux writes them.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <filesystem>
#include <fstream>

#include "profile/processor_watch.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using namespace qjulia::profiling;
using qjulia::test::TemporaryFolder;

namespace {

void write(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

/// @param ticks that programs and the host took.
void write_stat(const TemporaryFolder& root, long ticks, long stolen) {
  write(root.path() / "proc/stat",
        "cpu  " + std::to_string(ticks) + " 0 0 500 0 0 0 " + std::to_string(stolen) +
            " 0 0\ncpu0 1 2 3 4 5 6 7 8 9 0\ncpu1 1 2 3 4 5 6 7 8 9 0\nintr 5\nbtime 7\n");
}

}  // namespace

TEST_CASE("other programs' processors are those that this one did not have") {
  const TemporaryFolder root;
  write_stat(root, 1000, 20);
  const ProcessorWatch watch(root.path());
  write_stat(root, 1'000'000, 70'000);
  const auto use = watch.so_far();
  REQUIRE(use);
  CHECK(use->processors == 2);
  CHECK(use->others > 0);
  CHECK(use->others / use->stolen == Catch::Approx(999'000.0 / 69'980).epsilon(0.01));
  CHECK(use->throttled_times == 0);
  write_stat(root, 1000, 20);
  CHECK(watch.so_far()->others == 0);  // this program had all of it
}

TEST_CASE("a quota of processors is read from either version of control groups") {
  const TemporaryFolder root;
  write_stat(root, 1000, 0);
  const bool is_first = GENERATE(false, true);
  const std::string folder = is_first ? "sys/fs/cgroup/cpu,cpuacct/" : "sys/fs/cgroup/";
  write(root.path() / "proc/self/cgroup",
        is_first ? "5:memory:/a\n3:cpu,cpuacct:/a/b\n" : "0::/a/b\n");
  // In a container the group's path may not be there, but its files are at the top.
  const std::string group = GENERATE("a/b/", "");
  const auto file = root.path() / (folder + group + "cpu.stat");
  const std::string seconds = is_first ? "throttled_time " : "throttled_usec ";
  const std::string million = is_first ? "000000" : "000";  // of a millisecond's units
  write(file, "nr_periods 9\nnr_throttled 4\n" + seconds + "100" + million + "\n");
  const ProcessorWatch watch(root.path());
  write(file, "nr_periods 19\nnr_throttled 7\n" + seconds + "600" + million + "\n");
  const auto use = watch.so_far();
  REQUIRE(use);
  CHECK(use->throttled_times == 3);
  CHECK(use->throttled_seconds == Catch::Approx(0.5));
}

TEST_CASE("where the system says nothing, nothing is known") {
  const TemporaryFolder root;
  CHECK_FALSE(ProcessorWatch(root.path()).so_far());
  write(root.path() / "proc/stat", "cpu 1 2\n");
  CHECK_FALSE(ProcessorWatch(root.path()).so_far());
}

TEST_CASE("what kept a program from the processors is said") {
  CHECK(reasons({10, 2, 0.01, 0.01, 0, 0}).empty());
  const std::vector<std::string> all = reasons({10, 2, 1.25, 0.5, 1, 0.25});
  REQUIRE(all.size() == 3);
  CHECK(all[0] == "other programs had 1.2 of 2 processors");
  CHECK(all[1] == "the host of this virtual machine kept 0.5 of 2 processors");
  CHECK(all[2] == "a quota of processors stopped this program 1 time, for 0.25 s");
}
