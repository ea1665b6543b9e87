// Settings: what is read, and what is refused.

#include <catch2/catch_all.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "device/quirks.hpp"
#include "profile/workload.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/device/tuning.hpp"

using namespace qjulia;

namespace {

Tuning some() { return {8, 2, 32, 128, 4, 512, 64, 16}; }

}  // namespace

TEST_CASE("settings survive being written") {
  CHECK(tuning_from(to_json(some())) == some());
  CHECK_FALSE(Tuning{} == some());
}

TEST_CASE("settings out of range, missing or unknown are refused by name") {
  for (const char* name : {"lane_width", "energy_vectors", "gradient_rows", "orbit_items",
                           "orbit_group", "panel_samples", "panel_block", "product_side"}) {
    for (const nlohmann::json& wrong :
         {nlohmann::json(0), nlohmann::json(-3), nlohmann::json(1e30), nlohmann::json("8"),
          nlohmann::json(nullptr), nlohmann::json(std::numeric_limits<std::int64_t>::max()),
          nlohmann::json(std::numeric_limits<std::uint64_t>::max())}) {
      nlohmann::json json = to_json(some());
      json[name] = wrong;
      CAPTURE(json.dump());
      CHECK_THROWS_WITH(tuning_from(json), Catch::Matchers::ContainsSubstring(name));
    }
    nlohmann::json json = to_json(some());
    json.erase(name);
    CHECK_THROWS_AS(tuning_from(json), InputError);
    json["more"] = 1;
    CHECK_THROWS_AS(tuning_from(json), InputError);
  }
  Tuning tuning = some();
  tuning.lane_width = 4;
  CHECK_THROWS_WITH(tuning.validate(), Catch::Matchers::ContainsSubstring("1, 8 or 16"));
  tuning = some();
  tuning.product_side = 8;
  CHECK_THROWS_WITH(tuning.validate(), Catch::Matchers::ContainsSubstring("1, or 16"));
  tuning = some();
  tuning.panel_block = 100;
  CHECK_THROWS_WITH(tuning.validate(), Catch::Matchers::ContainsSubstring("multiple"));
}

TEST_CASE("layouts suit their devices, and ask for no larger groups than a device has") {
  DeviceInfo cpu;
  cpu.kind = DeviceKind::cpu;
  cpu.native_float_lanes = 16;
  cpu.largest_work_group = 4096;
  DeviceInfo gpu = cpu;
  gpu.kind = DeviceKind::gpu;
  gpu.native_float_lanes = 1;
  gpu.largest_work_group = 1024;
  CHECK(device::suited_layout(cpu) == Layout::cpu);
  CHECK(device::suited_layout(gpu) == Layout::gpu);
  const auto single = [](const DeviceInfo& info, Layout layout) {
    const Tuning tuning = device::default_tuning(info, Precision::single, layout);
    CHECK_NOTHROW(tuning.validate());
    return tuning;
  };
  CHECK(single(cpu, Layout::cpu).lane_width == 16);
  CHECK(device::default_tuning(cpu, Precision::dbl, Layout::cpu).lane_width == 8);
  CHECK(single(cpu, Layout::cpu).orbit_group == 1);
  CHECK(single(cpu, Layout::cpu).product_side == 1);
  // The layout of GPUs is the same on both.
  CHECK(single(cpu, Layout::gpu) == single(gpu, Layout::gpu));
  CHECK(single(gpu, Layout::gpu).lane_width == 1);
  CHECK(single(gpu, Layout::gpu).orbit_group == 64);
  CHECK(single(gpu, Layout::gpu).product_side == 16);
  CHECK(device::preferred_group_size(cpu, 16) == 4);
  CHECK(device::preferred_group_size(cpu, 1) == 64);
  CHECK(device::preferred_group_size(gpu, 8) == 64);

  gpu.largest_work_group = 100;
  CHECK(single(gpu, Layout::gpu).orbit_group == 64);
  CHECK(single(gpu, Layout::gpu).product_side == 1);
  gpu.largest_work_group = 1;
  CHECK(single(gpu, Layout::gpu).orbit_group == 1);
  CHECK(device::preferred_group_size(gpu, 1) == 1);

  // PoCL since 5.0 cannot be trusted with barriers on CPUs.
  DeviceInfo pocl = cpu;
  pocl.platform_name = "Portable Computing Language";
  for (const auto& [version, may] : {std::pair{"3.1", false},
                                     {"4.0", false},
                                     {"5.0", true},
                                     {"6.0-2+deb13u1", true},
                                     {"10.1", true},
                                     {"", false}}) {
    CAPTURE(version);
    pocl.driver_version = version;
    CHECK(device::may_miscompile_barriers(pocl) == may);
    CHECK(device::has_barriers(single(pocl, Layout::gpu)) == !may);
    CHECK_FALSE(device::has_barriers(single(pocl, Layout::cpu)));
  }
  pocl.driver_version = "6.0";
  pocl.kind = DeviceKind::gpu;
  CHECK(device::has_barriers(single(pocl, Layout::gpu)));
  pocl.kind = DeviceKind::cpu;
  pocl.platform_name = "another";
  CHECK(device::has_barriers(single(pocl, Layout::gpu)));
  Tuning groups = single(cpu, Layout::cpu);
  groups.orbit_group = 2;
  CHECK(device::has_barriers(groups));
  groups = single(cpu, Layout::cpu);
  groups.product_side = 16;
  CHECK(device::has_barriers(groups));

  DeviceInfo llvmpipe = cpu;
  llvmpipe.name = "llvmpipe (LLVM 15.0.6, 512 bits)";
  CHECK(device::suited_layout(llvmpipe) == Layout::cpu);
  CHECK(single(llvmpipe, Layout::cpu).lane_width == 1);
  CHECK(single(llvmpipe, Layout::cpu).orbit_group == 1);
}

#if defined(__aarch64__) || defined(__x86_64__)
TEST_CASE("a CPU has at least the lanes of its architecture, whatever its driver says") {
  CHECK(device::float_lanes(DeviceKind::cpu, 0) == 4);
  CHECK(device::float_lanes(DeviceKind::cpu, 1) == 4);
  CHECK(device::float_lanes(DeviceKind::cpu, 16) == 16);
  CHECK(device::float_lanes(DeviceKind::gpu, 1) == 1);
}
#endif

TEST_CASE("PoCL on aarch64 alone gets sources with the features of its own functions") {
  const std::string source = "kernel void f() {}\n";
  DeviceInfo arm;
  arm.kind = DeviceKind::cpu;
  arm.platform_name = "Portable Computing Language";
  arm.opencl_version = "OpenCL 3.0 PoCL HSTR: pthread-aarch64-unknown-linux-gnu-(null)";
  const std::string adapted = device::source_for(arm, source);
  CHECK_THAT(adapted, Catch::Matchers::StartsWith("#pragma clang attribute push") &&
                          Catch::Matchers::ContainsSubstring("#line 1\n" + source) &&
                          Catch::Matchers::EndsWith("#pragma clang attribute pop\n"));
  DeviceInfo other = arm;
  other.opencl_version = "OpenCL 3.0 PoCL HSTR: pthread-x86_64-pc-linux-gnu-znver4";
  CHECK(device::source_for(other, source) == source);
  other = arm;
  other.platform_name = "rusticl";
  CHECK(device::source_for(other, source) == source);
}

TEST_CASE("differences are of the largest number") {
  CHECK(profiling::largest_difference({1, 2, 100}, {1, 2, 100}) == 0);
  CHECK(profiling::largest_difference({1, 3, 100}, {1, 2, 100}) == Catch::Approx(0.01));
  CHECK(profiling::largest_difference({-1e-3}, {1e-3}) == Catch::Approx(2));
  CHECK(profiling::largest_difference({0, 0}, {0, 0}) == 0);
  CHECK(profiling::largest_difference({1}, {1, 2}) == std::numeric_limits<double>::infinity());
  CHECK(profiling::largest_difference({std::nan("")}, {1}) ==
        std::numeric_limits<double>::infinity());
  CHECK(profiling::largest_difference({std::numeric_limits<double>::infinity()}, {1}) ==
        std::numeric_limits<double>::infinity());
}
