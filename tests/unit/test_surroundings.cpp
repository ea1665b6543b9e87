/// What is said of machines and containers that hide their devices: in folders that stand for `/`.

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <catch2/catch_all.hpp>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>

#include "base/kernel_cache.hpp"
#include "base/surroundings.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using qjulia::base::Finding;
using qjulia::base::surroundings;
using qjulia::test::TemporaryFolder;

namespace {

/// A machine with a driver, and nothing wrong.
struct Machine {
  TemporaryFolder root;
  std::string drivers;  ///< the loader's variable, which is put back

  Machine() {
    if (const char* const own = std::getenv("OCL_ICD_VENDORS")) drivers = own;
    ::unsetenv("OCL_ICD_VENDORS");
    std::filesystem::permissions(root.path(), std::filesystem::perms(0755));
    file("etc/OpenCL/vendors/some.icd", "libc.so.6\n");
    file("proc/version", "Linux version 6.1.0 (gcc)");
  }
  ~Machine() {
    if (!drivers.empty()) ::setenv("OCL_ICD_VENDORS", drivers.c_str(), 1);
  }
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  std::filesystem::path file(const std::string& name, const std::string& text = "") const {
    std::filesystem::create_directories((root.path() / std::filesystem::path(name)).parent_path());
    return root.file(name, text);
  }
};

std::optional<Finding> found(const std::vector<Finding>& all, const std::string& kind) {
  for (const Finding& finding : all) {
    if (finding.kind == kind) return finding;
  }
  return std::nullopt;
}

/// The findings' texts, as a user without any privilege has them.
std::string as_nobody(const std::filesystem::path& root) {
  std::array<int, 2> ends{};
  REQUIRE(::pipe(ends.data()) == 0);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    std::string text = "cannot become another user";
    if (::geteuid() != 0 || (::setgid(kNobody) == 0 && ::setuid(kNobody) == 0)) {
      text.clear();
      for (const Finding& finding : surroundings(root)) text += finding.text + '\n';
    }
    const auto size = static_cast<ssize_t>(text.size());
    ::_exit(::write(ends[1], text.data(), text.size()) == size ? 0 : 1);
  }
  ::close(ends[1]);
  std::string text;
  std::array<char, 4096> part{};
  for (ssize_t n = 0; (n = ::read(ends[0], part.data(), part.size())) > 0;) {
    text.append(part.data(), static_cast<std::size_t>(n));
  }
  ::close(ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  CHECK(status == 0);
  return text;
}

}  // namespace

TEST_CASE("a machine with a driver has nothing to be told") {
  CHECK(surroundings(Machine().root.path()).empty());
}

TEST_CASE("a container says which nodes to pass") {
  for (const char* sign : {".dockerenv", "run/.containerenv"}) {
    const Machine machine;
    machine.file(sign);
    const auto finding = found(surroundings(machine.root.path()), "container");
    REQUIRE(finding);
    CHECK(finding->path == std::string("/") + sign);
    CHECK_THAT(finding->text, ContainsSubstring("--device /dev/dri") &&
                                  ContainsSubstring("--device /dev/kfd") &&
                                  ContainsSubstring("--gpus all"));
    machine.file("dev/dri/renderD128");
    CHECK_FALSE(found(surroundings(machine.root.path()), "container"));
  }
}

TEST_CASE("Windows' Subsystem for Linux is known by its kernel or its node") {
  const Machine by_kernel;
  by_kernel.file("proc/version", "Linux version 5.15.90.1-microsoft-standard-WSL2");
  const auto without_node = found(surroundings(by_kernel.root.path()), "wsl");
  REQUIRE(without_node);
  CHECK_THAT(without_node->text, ContainsSubstring("/dev/dxg (it is not there") &&
                                     ContainsSubstring("wsl --update") &&
                                     ContainsSubstring("intel-opencl-icd"));
  const Machine by_node;
  by_node.file("dev/dxg");
  const auto with_node = found(surroundings(by_node.root.path()), "wsl");
  REQUIRE(with_node);
  CHECK_THAT(with_node->text, ContainsSubstring("it is there"));
}

TEST_CASE("a flatpak says what to pass and where ICD files are") {
  const Machine machine;
  machine.file(".flatpak-info", "[Application]\n");
  const auto finding = found(surroundings(machine.root.path()), "flatpak");
  REQUIRE(finding);
  CHECK_THAT(finding->text, ContainsSubstring("--device=dri") &&
                                ContainsSubstring("OpenCL/vendors") &&
                                ContainsSubstring("OCL_ICD_VENDORS"));
}

TEST_CASE("a list of drivers that is empty is named") {
  const TemporaryFolder root;
  const Machine variable;  // takes the variable away
  const auto finding = found(surroundings(root.path()), "drivers");
  REQUIRE(finding);
  CHECK(finding->path == "/etc/OpenCL/vendors");
  CHECK_THAT(finding->text, ContainsSubstring("'/etc/OpenCL/vendors' holds no .icd file"));
  ::setenv("OCL_ICD_VENDORS", "/no/such/folder", 1);
  const auto own = found(surroundings(variable.root.path()), "drivers");
  REQUIRE(own);
  CHECK_THAT(own->text, ContainsSubstring("'/no/such/folder', which OCL_ICD_VENDORS names,"));
  ::unsetenv("OCL_ICD_VENDORS");
}

TEST_CASE("a message names the driver whose library cannot be loaded, and its .icd file") {
  const Machine machine;
  const auto file = machine.file("etc/OpenCL/vendors/other.icd", "libno-such-driver.so.1\n");
  const auto finding = found(surroundings(machine.root.path()), "library");
  REQUIRE(finding);
  CHECK(finding->path == file);
  CHECK_THAT(finding->text, ContainsSubstring("'" + file.string() + "'") &&
                                ContainsSubstring("'libno-such-driver.so.1'") &&
                                ContainsSubstring("No such file") &&
                                ContainsSubstring("install the driver again"));
}

TEST_CASE("a folder that PoCL cannot write its kernels to is named, where PoCL is installed") {
  const char* const own = std::getenv("POCL_CACHE_DIR");
  const std::string kept = own == nullptr ? "" : own;
  const Machine machine;
  ::setenv("POCL_CACHE_DIR", "/proc/no-such-folder", 1);
  CHECK(surroundings(machine.root.path()).empty());
  machine.file("libpocl-fake.so");
  machine.file("etc/OpenCL/vendors/pocl.icd", (machine.root / "libpocl-fake.so") + "\n");
  const auto finding = found(surroundings(machine.root.path()), "cache");
  own == nullptr ? ::unsetenv("POCL_CACHE_DIR") : ::setenv("POCL_CACHE_DIR", kept.c_str(), 1);
  REQUIRE(finding);
  CHECK(finding->path == "/proc/no-such-folder");
  CHECK_THAT(finding->text, ContainsSubstring("'/proc/no-such-folder' (from POCL_CACHE_DIR)") &&
                                ContainsSubstring("set POCL_CACHE_DIR to a folder"));
}

TEST_CASE("the folder of PoCL's kernels is the one that PoCL takes") {
  std::map<std::string, std::optional<std::string>> kept;
  for (const char* name : {"POCL_CACHE_DIR", "XDG_CACHE_HOME", "HOME"}) {
    const char* const own = std::getenv(name);
    kept[name] = own == nullptr ? std::nullopt : std::optional<std::string>(own);
    ::unsetenv(name);
  }
  const auto folder = [] { return qjulia::base::kernel_cache().folder; };
  const auto without = folder();
  ::setenv("HOME", "/home/somebody", 1);
  ::setenv("XDG_CACHE_HOME", "", 1);  // as if it were not set
  const auto of_home = folder();
  ::setenv("XDG_CACHE_HOME", "/caches", 1);
  const auto of_caches = folder();
  ::setenv("POCL_CACHE_DIR", "/kernels", 1);
  const auto own = folder();
  for (const auto& [name, value] : kept) {
    value ? ::setenv(name.c_str(), value->c_str(), 1) : ::unsetenv(name.c_str());
  }
  CHECK(without == "/tmp/pocl");
  CHECK(of_home == "/home/somebody/.cache/pocl");
  CHECK(of_caches == "/caches/pocl");
  CHECK(own == "/kernels");
}

TEST_CASE("a node that may not be opened is named with its group and a command") {
  const Machine machine;
  const std::array nodes{"dev/dri/renderD128", "dev/kfd", "dev/nvidia0"};
  for (const char* node : nodes) {
    const auto path = machine.file(node);
    REQUIRE(::chmod(path.c_str(), ::geteuid() == 0 ? 0660 : 0060) == 0);
    CHECK_THAT(
        as_nobody(machine.root.path()),
        ContainsSubstring("this user may not open /" + std::string(node) + "; it belongs to") &&
            ContainsSubstring("sudo usermod -aG "));
    REQUIRE(::chmod(path.c_str(), 0666) == 0);
    CHECK_THAT(as_nobody(machine.root.path()), !ContainsSubstring("may not open"));
  }
  const auto path = machine.file("dev/kfd");
  REQUIRE(::chmod(path.c_str(), ::geteuid() == 0 ? 0600 : 0000) == 0);
  CHECK_THAT(as_nobody(machine.root.path()), ContainsSubstring("no group may open it") &&
                                                 ContainsSubstring("sudo chgrp render /dev/kfd"));
  REQUIRE(::chmod(path.c_str(), ::geteuid() == 0 ? 0660 : 0060) == 0);
  machine.file(".dockerenv");
  CHECK_THAT(as_nobody(machine.root.path()), ContainsSubstring("--group-add "));
}

TEST_CASE("a GPU that draws a screen is known by its connectors") {
  const Machine machine;
  const auto card = [&](const std::string& name, const std::string& bus, const char* connector,
                        const char* status) {
    const auto device = machine.root.path() / ("sys/devices/pci0000:00/" + bus);
    std::filesystem::create_directories(device / "drm" / name);
    std::filesystem::create_directory_symlink(device, device / "drm" / name / "device");
    const auto entry = device / "drm" / name / (name + connector);
    std::filesystem::create_directories(entry);
    std::filesystem::create_directory_symlink(device / "drm" / name, entry / "device");
    std::ofstream(entry / "status") << status << '\n';
    const auto list = machine.root.path() / "sys/class/drm";
    std::filesystem::create_directories(list);
    std::filesystem::create_directory_symlink(device / "drm" / name, list / name);
    std::filesystem::create_directory_symlink(entry, list / (name + connector));
  };
  using qjulia::base::draws_screen;
  CHECK_FALSE(draws_screen("", machine.root.path()));
  card("card0", "0000:00:02.0", "-HDMI-A-1", "disconnected");
  CHECK_FALSE(draws_screen("", machine.root.path()));
  card("card1", "0000:01:00.0", "-DP-1", "connected");
  CHECK(draws_screen("0000:01:00.0", machine.root.path()));
  CHECK_FALSE(draws_screen("0000:00:02.0", machine.root.path()));
  CHECK_FALSE(draws_screen("0000:02:00.0", machine.root.path()));
  CHECK(draws_screen("", machine.root.path()));  // a driver that does not report its address
}
