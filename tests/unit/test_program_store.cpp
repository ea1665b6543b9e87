// Compiled programs on disk, and the marks that a process leaves which ends in the middle.

#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch_all.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/crash_marker.hpp"
#include "device/program_store.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using device::ProgramKey;
using device::ProgramStore;
using test::TemporaryFolder;

namespace {

const ProgramKey kStoredKey{"a GPU, its driver", "-DQJ_WIDTH=1", "kernel void f() {}"};
const device::StoredProgram kStored{{"f", "g"},
                                    std::string("\x7f"
                                                "ELF\0\n binary",
                                                13)};

std::string bytes_of(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

}  // namespace

TEST_CASE("a program is found by all that it depends on, and by nothing less") {
  const TemporaryFolder folder;
  const ProgramStore store(folder.path() / "programs");
  CHECK_FALSE(store.load(kStoredKey));
  store.save(kStoredKey, kStored);
  const auto found = store.load(kStoredKey);
  REQUIRE(found);
  CHECK(found->kernels == kStored.kernels);
  CHECK(found->binary == kStored.binary);
  for (const auto member : {&ProgramKey::owner, &ProgramKey::options, &ProgramKey::source}) {
    ProgramKey other = kStoredKey;
    other.*member += ' ';
    CHECK_FALSE(store.load(other));
    // Even where the file has its name.
    std::filesystem::copy_file(store.file(kStoredKey), store.file(other),
                               std::filesystem::copy_options::overwrite_existing);
    CHECK_FALSE(store.load(other));
  }
}

TEST_CASE("a damaged program is not found: cut anywhere, or with any byte changed") {
  const TemporaryFolder folder;
  const ProgramStore store(folder.path());
  store.save(kStoredKey, kStored);
  const auto path = store.file(kStoredKey);
  const std::string whole = bytes_of(path);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    CAPTURE(i);
    write_bytes(path, whole.substr(0, i));
    CHECK_FALSE(store.load(kStoredKey));
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ 4);
    write_bytes(path, changed);
    CHECK_FALSE(store.load(kStoredKey));
  }
  store.save(kStoredKey, kStored);
  CHECK(store.load(kStoredKey));
}

TEST_CASE("programs that were not used for longest go when there is no room") {
  const TemporaryFolder folder;
  const ProgramStore store(folder.path(), 3000);
  const auto key = [](int number) { return ProgramKey{"owner", std::to_string(number), "source"}; };
  const auto age = [&](int number, int hours) {
    const auto path = store.file(key(number));
    std::filesystem::last_write_time(
        path, std::filesystem::last_write_time(path) - std::chrono::hours(hours));
  };
  const device::StoredProgram large{{"f"}, std::string(1000, 'x')};
  for (int i = 0; i < 2; ++i) {
    store.save(key(i), large);
    age(i, 10 - i);
  }
  CHECK(store.load(key(0)));  // used now
  store.save(key(2), large);
  CHECK(store.load(key(0)));
  CHECK_FALSE(store.load(key(1)));
  CHECK(store.load(key(2)));
  // One that is too large itself is kept until the next comes.
  store.save(key(3), {{"f"}, std::string(2800, 'x')});
  CHECK(std::filesystem::exists(store.file(key(3))));
  CHECK_FALSE(store.load(key(2)));
}

TEST_CASE("a cache that cannot be made, written or listed is no error") {
  const TemporaryFolder folder;
  write_bytes(folder.path() / "file", "no folder");
  const ProgramStore below_file(folder.path() / "file" / "programs");
  CHECK_NOTHROW(below_file.save(kStoredKey, kStored));
  CHECK_FALSE(below_file.load(kStoredKey));
  const ProgramStore in_file(folder.path() / "file");
  CHECK_NOTHROW(in_file.save(kStoredKey, kStored));
  CHECK_FALSE(in_file.load(kStoredKey));

  // Files can be made in it, and nobody but root can list it.
  const auto unlisted = folder.path() / "unlisted";
  std::filesystem::create_directory(unlisted);
  std::filesystem::permissions(folder.path(), std::filesystem::perms(0755));
  std::filesystem::permissions(unlisted, std::filesystem::perms(0333));
  const pid_t child = ::fork();
  if (child == 0) {
    constexpr id_t kNobody = 65534;
    int code = 1;
    if (::geteuid() != 0 || (::setgid(kNobody) == 0 && ::setuid(kNobody) == 0)) {
      try {
        const ProgramStore store(unlisted);
        store.save(kStoredKey, kStored);
        code = store.load(kStoredKey) ? 0 : 2;
      } catch (const std::exception&) {
        code = 3;
      }
    }
    ::_exit(code);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  std::filesystem::permissions(unlisted, std::filesystem::perms(0777));
  CHECK(status == 0);
}

TEST_CASE("a process that ends in the middle leaves its mark, and no other does") {
  const TemporaryFolder folder;
  const auto path = folder.path() / "x.building";
  const auto run = [&](bool forgets) {
    const pid_t child = ::fork();
    if (child == 0) {
      base::CrashMarker marker(path);
      marker.mark("source");
      if (forgets) base::CrashMarker::forget_all();
      ::_exit(0);
    }
    ::waitpid(child, nullptr, 0);
  };
  run(true);
  CHECK_FALSE(std::filesystem::exists(path));
  run(false);
  {
    const base::CrashMarker refused(path);
    CHECK(refused.left() == "source");
    // What somebody is doing now is not what one has left.
    CHECK(base::CrashMarker(path).left().empty());
  }
  {
    base::CrashMarker again(path);
    CHECK(again.left() == "source");
    again.mark("source");
  }
  CHECK_FALSE(std::filesystem::exists(path));
  base::CrashMarker nowhere(folder.path() / "none" / "x");
  nowhere.mark("source");
  CHECK(nowhere.left().empty());
}
