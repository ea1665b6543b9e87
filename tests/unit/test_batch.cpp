/// The batch's bookkeeping, with workers that only pretend.

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <mutex>
#include <new>
#include <set>
#include <thread>

#include "batch/claim.hpp"
#include "qjulia/batch.hpp"
#include "qjulia/error.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::Contains;
using qjulia::test::read_text;
using qjulia::test::TemporaryFolder;
using Work =
    std::function<EntryResult(const BatchEntry&, const std::filesystem::path&, const Watch&)>;

namespace {

class Pretender final : public BatchWorker {
 public:
  explicit Pretender(Work work) : work_(std::move(work)) {}
  EntryResult run(const BatchEntry& entry, const std::filesystem::path& folder,
                  const Watch& watch) override {
    return work_(entry, folder, watch);
  }

 private:
  Work work_;
};

BatchDevice device(const std::string& name, Work work) {
  return {name, [work = std::move(work)] { return std::make_unique<Pretender>(work); }};
}

EntryResult write_map(const BatchEntry& entry, const std::filesystem::path& folder, const Watch&) {
  std::ofstream(folder / (entry.name + ".qjulia.json")) << "map of " << entry.name;
  return {{entry.name + ".qjulia.json"}, {{"energy", 0.5}}};
}

EntryResult broken(const BatchEntry&, const std::filesystem::path&, const Watch&) {
  throw DeviceError("broken", "clFinish", -5);
}

Manifest manifest_of(const std::vector<std::string>& names) {
  Manifest manifest;
  for (const std::string& name : names) {
    manifest.entries.push_back({name, name + ".obj", {}, {}, 1});
  }
  return manifest;
}

BatchOptions options_for(const TemporaryFolder& folder, bool resume = false) {
  return {folder.path(), resume, false, [](const BatchEntry& entry) {
            return FitKey{"inputs of " + entry.name, "options"};
          }};
}

EntryStatus status_of(const TemporaryFolder& folder, const std::string& name) {
  const auto all = read_batch(folder.path());
  return *std::ranges::find(all, name, &EntryStatus::name);
}

/// Runs with one device and returns the names of the entries that were worked on.
std::vector<std::string> run(const Manifest& manifest, const BatchOptions& options,
                             const Work& work = write_map) {
  std::vector<std::string> worked_on;
  prepare_batch(manifest, options);
  run_batch(manifest,
            {device("one",
                    [&](const auto& entry, const auto& folder, const auto& watch) {
                      worked_on.push_back(entry.name);
                      return work(entry, folder, watch);
                    })},
            options);
  return worked_on;
}

EntryResult all_but_b(const BatchEntry& entry, const std::filesystem::path& folder,
                      const Watch& watch) {
  if (entry.name == "b") throw InputError("b cannot be read");
  return write_map(entry, folder, watch);
}

}  // namespace

TEST_CASE("an entry that fails leaves the others alone") {
  const TemporaryFolder folder;
  run(manifest_of({"a", "b", "c"}), options_for(folder), all_but_b);
  CHECK(status_of(folder, "a").state == EntryState::done);
  CHECK(status_of(folder, "b").state == EntryState::failed);
  CHECK(status_of(folder, "b").error == "b cannot be read");
  CHECK(status_of(folder, "c").state == EntryState::done);
  CHECK(status_of(folder, "c").figures["energy"] == 0.5);
  for (const std::string& name : folder.names()) CHECK_FALSE(name.ends_with(".claim"));
}

TEST_CASE("resuming does what is not complete for the same inputs and options") {
  const TemporaryFolder folder;
  const Manifest manifest = manifest_of({"a", "b", "c"});
  run(manifest, options_for(folder), all_but_b);
  const BatchOptions resumed = options_for(folder, true);
  CHECK(run(manifest, resumed).empty());

  SECTION("failed ones when asked") {
    BatchOptions again = resumed;
    again.retry_failed = true;
    CHECK(run(manifest, again) == std::vector<std::string>{"b"});
    CHECK(status_of(folder, "b").state == EntryState::done);
  }
  SECTION("one whose output is gone") {
    std::filesystem::remove(folder / "c.qjulia.json");
    CHECK(run(manifest, resumed) == std::vector<std::string>{"c"});
  }
  SECTION("one whose mesh has changed") {
    BatchOptions changed = resumed;
    changed.key = [](const BatchEntry& entry) {
      return FitKey{(entry.name == "a" ? "other inputs of " : "inputs of ") + entry.name,
                    "options"};
    };
    CHECK(run(manifest, changed) == std::vector<std::string>{"a"});
  }
  SECTION("all when options have changed") {
    BatchOptions changed = resumed;
    changed.key = [](const BatchEntry& e) { return FitKey{"inputs of " + e.name, "others"}; };
    CHECK(run(manifest, changed).size() == 3);
  }
  SECTION("not one whose mesh is gone") {
    BatchOptions changed = resumed;
    changed.key = [](const BatchEntry& entry) {
      return FitKey{entry.name == "a" ? "" : "inputs of " + entry.name, "options"};
    };
    CHECK(run(manifest, changed).empty());
  }
  SECTION("one whose status is half a file") {
    folder.file("a.status.json", "{\"name\": \"a\", ");
    CHECK(run(manifest, resumed) == std::vector<std::string>{"a"});
  }
  SECTION("all when not resuming") { CHECK(run(manifest, options_for(folder)).size() == 3); }
}

TEST_CASE("a device that keeps failing is retired and its work done by another") {
  const TemporaryFolder folder;
  const Manifest manifest = manifest_of({"a", "b", "c", "d", "e", "f"});
  const BatchOptions options = options_for(folder);
  prepare_batch(manifest, options);
  int retired = 0;
  std::atomic<int> failures = 0;
  const auto unsaved =
      run_batch(manifest,
                {device("broken",
                        [&](const auto& entry, const auto& path, const auto& watch) {
                          ++failures;
                          return broken(entry, path, watch);
                        }),
                 device("good",
                        [&](const auto& entry, const auto& path, const auto& watch) {
                          // Slow enough for the other to fail three.
                          std::this_thread::sleep_for(std::chrono::milliseconds(40));
                          return write_map(entry, path, watch);
                        })},
                options, [&](const BatchEvent& event) {
                  if (event.kind == BatchEvent::Kind::retired) ++retired;
                });
  CHECK(unsaved.empty());
  CHECK(retired == 1);
  CHECK(failures == 3);
  for (const EntryStatus& status : read_batch(folder.path())) {
    CHECK(status.state == EntryState::done);
    CHECK(status.device == "good");
  }
}

TEST_CASE("an entry that every device fails at has failed; the device goes on") {
  const TemporaryFolder folder;
  const Manifest manifest = manifest_of({"huge", "a", "b"});
  const auto worked_on = run(
      manifest, options_for(folder), [](const auto& entry, const auto& path, const auto& watch) {
        return entry.name == "huge" ? broken(entry, path, watch) : write_map(entry, path, watch);
      });
  CHECK(status_of(folder, "huge").state == EntryState::failed);
  CHECK(status_of(folder, "huge").failed_tries.size() == 3);
  CHECK_THAT(status_of(folder, "huge").error, Contains("CL_OUT_OF_RESOURCES"));
  CHECK(status_of(folder, "a").state == EntryState::done);
  CHECK(status_of(folder, "b").state == EntryState::done);
  // The others come before it is tried again.
  CHECK(worked_on == std::vector<std::string>{"huge", "a", "b", "huge", "huge"});
}

TEST_CASE("with no device left entries wait for another run") {
  const TemporaryFolder folder;
  const Manifest manifest = manifest_of({"a", "b", "c", "d"});
  run(manifest, options_for(folder), broken);
  for (const EntryStatus& status : read_batch(folder.path())) {
    CHECK(status.state == EntryState::waiting);
  }
  CHECK(run(manifest, options_for(folder, true)).size() == 4);
}

TEST_CASE("a stop request ends the entry that runs and begins no other") {
  const TemporaryFolder folder;
  const Manifest manifest = manifest_of({"a", "b"});
  const BatchOptions options = options_for(folder);
  prepare_batch(manifest, options);
  std::stop_source stop;
  run_batch(manifest,
            {device("one",
                    [&](const auto&, const auto&, const auto& watch) -> EntryResult {
                      stop.request_stop();
                      if (watch.stop.stop_requested()) throw Interrupted();
                      return {};
                    })},
            options, {}, stop.get_token());
  CHECK(status_of(folder, "a").state == EntryState::interrupted);
  CHECK(status_of(folder, "b").state == EntryState::waiting);
  CHECK(run(manifest, options_for(folder, true)).size() == 2);
}

TEST_CASE("memory that does not suffice fails the entry") {
  const TemporaryFolder folder;
  run(manifest_of({"a"}), options_for(folder),
      [](const auto&, const auto&, const auto&) -> EntryResult { throw std::bad_alloc(); });
  CHECK(status_of(folder, "a").error == "out of memory");
}

TEST_CASE("what cannot be written down is handed back") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "b.status.json");
  const Manifest manifest = manifest_of({"a", "b", "c"});
  BatchOptions options = options_for(folder, true);
  prepare_batch(manifest, options);
  const auto unsaved = run_batch(manifest, {device("one", write_map)}, options);
  REQUIRE(unsaved.size() == 1);
  CHECK(unsaved[0].name == "b");
  CHECK(unsaved[0].state == EntryState::failed);
  CHECK_THAT(unsaved[0].error, Contains("b.status.json"));
  CHECK(status_of(folder, "c").state == EntryState::done);
}

TEST_CASE("each entry is done once by processes that share a folder") {
  const TemporaryFolder folder;
  std::vector<std::string> names;
  for (int i = 0; i < 60; ++i) names.push_back("entry" + std::to_string(i));
  const Manifest manifest = manifest_of(names);
  const BatchOptions options = options_for(folder);
  prepare_batch(manifest, options);
  const auto work = [&](const std::string& who) {
    return device(who, [who](const BatchEntry& entry, const auto& path, const auto& watch) {
      // Appended to: a second visit would show.
      std::ofstream(path / (entry.name + ".visits"), std::ios::app) << who << '\n';
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      return write_map(entry, path, watch);
    });
  };
  std::vector<pid_t> children;
  for (const char* who : {"p", "q", "r"}) {
    const pid_t child = ::fork();
    if (child == 0) {
      run_batch(manifest, {work(who), work(who)}, options);
      ::_exit(0);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) ::waitpid(child, nullptr, 0);
  std::set<std::string> workers;
  for (const std::string& name : names) {
    const std::string visits = read_text(folder.path() / (name + ".visits"));
    CHECK(visits.size() == 2);
    workers.insert(visits);
  }
  CHECK(workers.size() == 3);
}

TEST_CASE("what a killed process had claimed is done by the next") {
  const TemporaryFolder folder;
  const Manifest manifest = manifest_of({"a", "b"});
  const BatchOptions options = options_for(folder);
  prepare_batch(manifest, options);
  const pid_t child = ::fork();
  if (child == 0) {
    run_batch(manifest,
              {device("one",
                      [](const auto& entry, const auto& path, const auto& watch) {
                        if (entry.name == "b") ::raise(SIGKILL);
                        return write_map(entry, path, watch);
                      })},
              options);
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  folder.file("b.qjulia.json.12345.tmp", "half a m");
  CHECK(std::filesystem::exists(folder / "b.claim"));
  CHECK(status_of(folder, "a").state == EntryState::done);
  CHECK(status_of(folder, "b").state == EntryState::lost);
  CHECK(run(manifest, options_for(folder, true)) == std::vector<std::string>{"b"});
  CHECK(status_of(folder, "b").state == EntryState::done);
  CHECK_FALSE(std::filesystem::exists(folder / "b.qjulia.json.12345.tmp"));
}

TEST_CASE("a folder that a living process works in is not begun anew") {
  const TemporaryFolder folder;
  const Manifest manifest = manifest_of({"a"});
  std::filesystem::create_directories(folder.path());
  const auto claim = batch::Claim::take(folder / "a.claim");
  REQUIRE(claim);
  CHECK_FALSE(batch::Claim::take(folder / "a.claim"));
  CHECK_THROWS_AS(prepare_batch(manifest, options_for(folder)), InputError);
  CHECK_NOTHROW(prepare_batch(manifest, options_for(folder, true)));
}

TEST_CASE("claims of other hosts die of age") {
  const TemporaryFolder folder;
  const auto path = folder.file("a.claim", R"({"host": "far", "process": 1, "process_start": 1})");
  CHECK(batch::claim_state(path) == batch::ClaimState::living);
  CHECK_FALSE(batch::break_dead_claim(path));
  std::filesystem::last_write_time(
      path, std::filesystem::file_time_type::clock::now() - std::chrono::seconds(300));
  CHECK(batch::claim_state(path) == batch::ClaimState::dead);
  CHECK(batch::break_dead_claim(path));
  CHECK(batch::claim_state(path) == batch::ClaimState::none);
}

TEST_CASE("summaries hold every entry") {
  const TemporaryFolder folder;
  run(manifest_of({"a", "b", "c,\"d\""}), options_for(folder), all_but_b);
  write_summary(folder.path(), read_batch(folder.path()));
  const auto json = nlohmann::json::parse(read_text(folder.path() / "summary.json"));
  CHECK(json["counts"]["done"] == 2);
  CHECK(json["counts"]["failed"] == 1);
  CHECK(json["entries"][1]["error"] == "b cannot be read");
  const std::string csv = read_text(folder.path() / "summary.csv");
  CHECK_THAT(csv, Contains("b,b.obj,failed,"));
  CHECK_THAT(csv, Contains("\"c,\"\"d\"\"\","));
  CHECK_THROWS_AS(read_batch(folder / "nowhere"), InputError);
}
