#include <catch2/catch_all.hpp>
#include <filesystem>
#include <string>
#include <utility>

#include "batch/energy_meter.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using qjulia::test::TemporaryFolder;

TEST_CASE("joules are those of processors' packages, in equal parts for entries at the same time") {
  const TemporaryFolder folder;
  const auto zone = [&](const std::string& name, const std::string& what, const char* microjoules) {
    std::filesystem::create_directories(folder.path() / name);
    folder.file(name + "/name", what + "\n");
    folder.file(name + "/max_energy_range_uj", "10000000\n");
    folder.file(name + "/energy_uj", microjoules);
  };
  CHECK(batch::cpu_energy_counters(folder / "none").empty());
  zone("intel-rapl:0", "package-0", "1000000\n");
  zone("intel-rapl:0:0", "core", "1\n");  // within its package
  zone("intel-rapl:1", "psys", "1\n");    // with all packages in it
  zone("intel-rapl:2", "package-1", "9000000\n");
  zone("intel-rapl:3", "package-2", "");  // may not be read
  auto counters = batch::cpu_energy_counters(folder.path());
  REQUIRE(counters.size() == 2);
  batch::EnergyMeter meter(std::move(counters));
  {
    batch::EnergyMeter::Account first(meter);
    zone("intel-rapl:0", "package-0", "3000000\n");
    CHECK(first.joules() == 2);
    batch::EnergyMeter::Account second(meter);
    zone("intel-rapl:2", "package-1", "1000000\n");  // it has begun again: 2 J more
    CHECK(first.joules() == 3);
    CHECK(second.joules() == 1);
    zone("intel-rapl:2", "package-1", "");
    CHECK_FALSE(first.joules());
    zone("intel-rapl:2", "package-1", "1000000\n");
    CHECK_FALSE(first.joules());
  }
  batch::EnergyMeter::Account later(meter);
  CHECK(later.joules() == 0);

  std::filesystem::create_directories(folder.path() / "0000:03:00.0/hwmon/hwmon4");
  CHECK(batch::gpu_energy_counters("0000:03:00.0", folder.path()).empty());
  folder.file("0000:03:00.0/hwmon/hwmon4/energy1_input", "5\n");
  CHECK(batch::gpu_energy_counters("0000:03:00.0", folder.path()).size() == 1);
  CHECK(batch::gpu_energy_counters("", folder.path()).empty());
  // A driver that is loaded again counts from 0.
  batch::EnergyMeter of_gpu(batch::gpu_energy_counters("0000:03:00.0", folder.path()));
  batch::EnergyMeter::Account account(of_gpu);
  folder.file("0000:03:00.0/hwmon/hwmon4/energy1_input", "2000005\n");
  CHECK(account.joules() == 2);
  folder.file("0000:03:00.0/hwmon/hwmon4/energy1_input", "1\n");
  CHECK_FALSE(account.joules());
}
