/// The batch's bookkeeping, with workers that only pretend.

#include <fcntl.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <catch2/catch_all.hpp>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <latch>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <thread>

#include "base/output_file.hpp"
#include "batch/batch.hpp"
#include "batch/energy_meter.hpp"
#include "batch/entry_keys.hpp"
#include "batch/event_log.hpp"
#include "batch/folder_lock.hpp"
#include "batch/round.hpp"
#include "batch/shard.hpp"
#include "batch/summary_table.hpp"
#include "qjulia/base/error.hpp"
#include "rank_threads.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;
using qjulia::test::read_text;
using qjulia::test::TemporaryFolder;
using Work = batch::BatchWorker;

namespace {

batch::BatchDevice device(const std::string& name, Work work) {
  return {name, [work = std::move(work)] { return work; }};
}

batch::EntryResult write_map(const batch::BatchEntry& entry, const std::filesystem::path& folder,
                             const ProgressMonitor&) {
  std::ofstream(folder / (entry.name + ".qjulia.json")) << "map of " << entry.name;
  return {{entry.name + ".qjulia.json"}, {{"energy", 0.5}}};
}

batch::EntryResult broken(const batch::BatchEntry&, const std::filesystem::path&,
                          const ProgressMonitor&) {
  throw DeviceError("broken", "clFinish", -5);
}

batch::Manifest manifest_of(const std::vector<std::string>& names) {
  batch::Manifest manifest;
  for (const std::string& name : names) {
    manifest.entries.push_back({name, name + ".obj", {}, {}, 1});
  }
  return manifest;
}

batch::BatchOptions options_for(const TemporaryFolder& folder, bool resume = false) {
  return {folder.path(), resume, false, [](const batch::BatchEntry& entry) {
            return batch::FitKey{"inputs of " + entry.name, "options"};
          }};
}

batch::EntryStatus status_of(const TemporaryFolder& folder, const std::string& name) {
  const auto all = batch::read_batch(folder.path(), false);
  return *std::ranges::find(all, name, &batch::EntryStatus::name);
}

/// Runs with one device and returns the names of the entries that were worked on.
std::vector<std::string> run(const batch::Manifest& manifest, const batch::BatchOptions& options,
                             const Work& work = write_map) {
  std::vector<std::string> worked_on;
  const auto lock = batch::prepare_batch(manifest, options);
  batch::run_batch(manifest,
                   {device("one",
                           [&](const auto& entry, const auto& folder, const auto& monitor) {
                             worked_on.push_back(entry.name);
                             return work(entry, folder, monitor);
                           })},
                   options);
  return worked_on;
}

batch::EntryResult all_but_b(const batch::BatchEntry& entry, const std::filesystem::path& folder,
                             const ProgressMonitor& monitor) {
  if (entry.name == "b") throw InputError("b cannot be read");
  return write_map(entry, folder, monitor);
}

}  // namespace

TEST_CASE("an entry that fails leaves the others alone") {
  const TemporaryFolder folder;
  run(manifest_of({"a", "b", "c"}), options_for(folder), all_but_b);
  CHECK(status_of(folder, "a").state == batch::EntryState::done);
  CHECK(status_of(folder, "b").state == batch::EntryState::failed);
  CHECK(status_of(folder, "b").error == "b cannot be read");
  CHECK(status_of(folder, "c").state == batch::EntryState::done);
  CHECK(status_of(folder, "c").figures["energy"] == 0.5);
}

TEST_CASE("resuming does what is not complete for the same inputs and options") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b", "c"});
  run(manifest, options_for(folder), all_but_b);
  const batch::BatchOptions resumed = options_for(folder, true);
  CHECK(run(manifest, resumed).empty());

  SECTION("failed ones when asked") {
    batch::BatchOptions again = resumed;
    again.retry_failed = true;
    CHECK(run(manifest, again) == std::vector<std::string>{"b"});
    CHECK(status_of(folder, "b").state == batch::EntryState::done);
  }
  SECTION("one whose output is gone") {
    std::filesystem::remove(folder / "c.qjulia.json");
    CHECK(run(manifest, resumed) == std::vector<std::string>{"c"});
  }
  SECTION("one whose output is empty") {
    folder.file("c.qjulia.json", "");
    CHECK(run(manifest, resumed) == std::vector<std::string>{"c"});
  }
  SECTION("one whose mesh has changed") {
    batch::BatchOptions changed = resumed;
    changed.key = [](const batch::BatchEntry& entry) {
      return batch::FitKey{(entry.name == "a" ? "other inputs of " : "inputs of ") + entry.name,
                           "options"};
    };
    CHECK(run(manifest, changed) == std::vector<std::string>{"a"});
  }
  SECTION("all when options have changed") {
    batch::BatchOptions changed = resumed;
    changed.key = [](const batch::BatchEntry& e) {
      return batch::FitKey{"inputs of " + e.name, "others"};
    };
    CHECK(run(manifest, changed).size() == 3);
  }
  SECTION("not one whose mesh is gone") {
    batch::BatchOptions changed = resumed;
    changed.key = [](const batch::BatchEntry& entry) {
      return batch::FitKey{entry.name == "a" ? "" : "inputs of " + entry.name, "options"};
    };
    CHECK(run(manifest, changed).empty());
  }
  SECTION("one whose status is half a file") {
    folder.file("a.status.json", "{\"name\": \"a\", ");
    CHECK(run(manifest, resumed) == std::vector<std::string>{"a"});
  }
  SECTION("one whose status is nested so deep that nothing reads it") {
    std::string status = read_text(folder.path() / "a.status.json");
    const auto number = status.find("0.5");
    REQUIRE(number != std::string::npos);
    status.replace(number, 3, std::string(1'000'000, '[') + std::string(1'000'000, ']'));
    folder.file("a.status.json", status);
    CHECK(run(manifest, resumed) == std::vector<std::string>{"a"});
  }
  SECTION("one whose status is not text") {
    folder.file("a.status.json", "\xff\xfe{");
    CHECK(run(manifest, resumed) == std::vector<std::string>{"a"});
  }
  SECTION("all when not resuming") { CHECK(run(manifest, options_for(folder)).size() == 3); }
}

TEST_CASE("a batch that does all again and is stopped keeps what it has not begun") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b", "c"});
  run(manifest, options_for(folder));
  std::stop_source stop;
  {
    const batch::BatchOptions options = options_for(folder);
    const auto lock = batch::prepare_batch(manifest, options);
    batch::run_batch(manifest,
                     {device("one",
                             [&](const auto&, const auto&, const auto&) -> batch::EntryResult {
                               stop.request_stop();
                               throw Interrupted();
                             })},
                     options, {}, stop.get_token());
  }
  CHECK(status_of(folder, "a").state == batch::EntryState::interrupted);
  CHECK(status_of(folder, "b").state == batch::EntryState::done);
  CHECK(run(manifest, options_for(folder, true)) == std::vector<std::string>{"a"});
}

TEST_CASE("an entry done again loses the outputs that it no longer has, but no input") {
  const TemporaryFolder folder;
  batch::Manifest manifest = manifest_of({"a", "b"});
  const auto work = [](const batch::BatchEntry& entry, const std::filesystem::path& path,
                       const ProgressMonitor& monitor) {
    batch::EntryResult result = write_map(entry, path, monitor);
    result.files.push_back(entry.name + entry.outputs.surface->extension);
    std::ofstream(path / result.files.back()) << "surface";
    return result;
  };
  for (batch::BatchEntry& entry : manifest.entries)
    entry.outputs.surface = batch::EntryJob{"surface", ".obj"};
  run(manifest, options_for(folder), work);
  for (batch::BatchEntry& entry : manifest.entries)
    entry.outputs.surface = batch::EntryJob{"surface", ".ply"};
  manifest.entries[1].mesh = folder / "b.obj";
  batch::BatchOptions changed = options_for(folder, true);
  changed.key = [](const batch::BatchEntry&) { return batch::FitKey{"inputs", "others"}; };
  CHECK(run(manifest, changed, work).size() == 2);
  CHECK_FALSE(std::filesystem::exists(folder / "a.obj"));
  CHECK(std::filesystem::exists(folder / "b.obj"));
  for (const char* name : {"a.ply", "a.qjulia.json", "b.ply", "a.status.json"}) {
    CHECK(std::filesystem::exists(folder / name));
  }
}

TEST_CASE("an entry is begun when the one it follows is done, and its key is of both") {
  const TemporaryFolder folder;
  batch::Manifest manifest = manifest_of({"a", "b", "c", "x"});
  manifest.entries[1].follows = "a";
  manifest.entries[2].follows = "b";
  std::map<std::string, std::string> inputs{{"a", "1"}, {"b", "2"}, {"c", "3"}, {"x", "4"}};
  batch::BatchOptions options = options_for(folder);
  options.key = [&](const batch::BatchEntry& entry) {
    return batch::FitKey{inputs.at(entry.name), "options"};
  };
  std::mutex noting;
  std::vector<std::string> begun;
  const auto note = [&](const batch::BatchEntry& entry, const std::filesystem::path& where,
                        const ProgressMonitor& monitor) {
    if (!entry.follows.empty()) {
      CHECK(std::filesystem::exists(where / (entry.follows + ".qjulia.json")));
    }
    const std::lock_guard lock(noting);
    begun.push_back(entry.name);
    return write_map(entry, where, monitor);
  };
  const auto run_with_three = [&] {
    begun.clear();
    const auto lock = batch::prepare_batch(manifest, options);
    batch::run_batch(manifest, {device("one", note), device("two", note), device("three", note)},
                     options);
    std::ranges::sort(begun);
    return begun;
  };
  CHECK(run_with_three() == std::vector<std::string>{"a", "b", "c", "x"});
  options.resume = true;
  CHECK(run_with_three().empty());
  inputs["b"] = "changed";
  CHECK(run_with_three() == std::vector<std::string>{"b", "c"});
  CHECK(run_with_three().empty());
  std::filesystem::remove(folder.path() / "a.qjulia.json");
  CHECK(run_with_three() == std::vector<std::string>{"a"});  // it is made again as it was
  inputs["a"] = "";  // a mesh that has vanished does not undo what was made of it
  CHECK(run_with_three().empty());
}

TEST_CASE("meshes are read side by side for the keys of entries") {
  batch::Manifest manifest = manifest_of({"a", "b"});
  std::mutex counting;
  std::condition_variable changed;
  int reading = 0, together = 0;
  batch::BatchOptions options;
  options.key = [&](const batch::BatchEntry& entry) {
    std::unique_lock lock(counting);
    ++reading;
    changed.notify_all();
    if (changed.wait_for(lock, std::chrono::seconds(60), [&] { return reading == 2; })) ++together;
    return batch::FitKey{entry.name, "options"};
  };
  batch::EntryKeys keys(manifest, options);
  {
    const std::jthread other([&] { CHECK(keys.of(1).inputs == "b"); });
    CHECK(keys.of(0).inputs == "a");
  }
  CHECK(together == 2);
}

TEST_CASE("an entry begins whatever has become of the status file of the one before it") {
  const TemporaryFolder folder;
  batch::Manifest manifest = manifest_of({"a", "b"});
  manifest.entries[1].follows = "a";
  const batch::BatchOptions options = options_for(folder);
  const auto lock = batch::prepare_batch(manifest, options);
  batch::run_batch(manifest, {device("one", write_map)}, options,
                   [&](const batch::BatchEvent& event) {
                     if (event.kind != batch::BatchEvent::Kind::started) return;
                     if (event.status->name != "b") return;
                     std::filesystem::remove(folder.path() / "a.status.json");
                   });
  CHECK(status_of(folder, "b").state == batch::EntryState::done);
}

TEST_CASE("an entry fails where the one it follows has failed, and both are tried again") {
  const TemporaryFolder folder;
  batch::Manifest manifest = manifest_of({"a", "b", "c", "d"});
  manifest.entries[2].follows = "b";
  manifest.entries[3].follows = "c";
  CHECK(run(manifest, options_for(folder), all_but_b) == std::vector<std::string>{"a", "b"});
  CHECK(status_of(folder, "a").state == batch::EntryState::done);
  for (const auto& [name, before] : {std::pair("c", "'b'"), std::pair("d", "'c'")}) {
    CHECK(status_of(folder, name).state == batch::EntryState::failed);
    CHECK_THAT(status_of(folder, name).error,
               ContainsSubstring(before) && ContainsSubstring("has no map to start from"));
  }
  batch::BatchOptions again = options_for(folder, true);
  again.retry_failed = true;
  CHECK(run(manifest, again) == std::vector<std::string>{"b", "c", "d"});
}

TEST_CASE("a sequence stays on one shard") {
  const auto names_of = [](std::size_t number) {
    batch::Manifest manifest = manifest_of({"a", "b1", "b2", "b3", "c", "d"});
    manifest.entries[2].follows = "b1";
    manifest.entries[3].follows = "b2";
    batch::keep_shard(manifest, {number, 2});
    std::string names;
    for (const auto& entry : manifest.entries) {
      names += entry.name + std::to_string(entry.place) + " ";
    }
    return names;
  };
  CHECK(names_of(1) == "a0 c4 ");
  CHECK(names_of(2) == "b11 b22 b33 d5 ");
}

TEST_CASE("a device that keeps failing is retired and its work done by another") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b", "c", "d", "e", "f"});
  const batch::BatchOptions options = options_for(folder);
  const auto lock = batch::prepare_batch(manifest, options);
  int retired = 0;
  std::atomic<int> failures = 0;
  const auto unsaved =
      batch::run_batch(manifest,
                       {device("broken",
                               [&](const auto& entry, const auto& path, const auto& monitor) {
                                 ++failures;
                                 return broken(entry, path, monitor);
                               }),
                        device("good",
                               [&](const auto& entry, const auto& path, const auto& monitor) {
                                 // Slow enough for the other to fail three.
                                 std::this_thread::sleep_for(std::chrono::milliseconds(40));
                                 return write_map(entry, path, monitor);
                               })},
                       options, [&](const batch::BatchEvent& event) {
                         if (event.kind == batch::BatchEvent::Kind::retired) ++retired;
                       });
  CHECK(unsaved.empty());
  CHECK(retired == 1);
  CHECK(failures == 3);
  for (const batch::EntryStatus& status : batch::read_batch(folder.path(), false)) {
    CHECK(status.state == batch::EntryState::done);
    CHECK(status.device == "good");
  }
}

TEST_CASE("a device that is lost is retired before its entry has failed, and another does it") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b"});
  const batch::BatchOptions options = options_for(folder);
  const auto lock = batch::prepare_batch(manifest, options);
  std::vector<std::string> retired;
  batch::run_batch(manifest,
                   {device("lost",
                           [](const auto&, const auto&, const auto&) -> batch::EntryResult {
                             throw DeviceError("lost", "clFinish", -36);
                           }),
                    device("good",
                           [](const auto& entry, const auto& path, const auto& monitor) {
                             // Slow enough for the other to fail three times.
                             std::this_thread::sleep_for(std::chrono::milliseconds(200));
                             return write_map(entry, path, monitor);
                           })},
                   options, [&](const batch::BatchEvent& event) {
                     if (event.kind == batch::BatchEvent::Kind::retired) {
                       retired.push_back(event.message);
                     }
                   });
  REQUIRE(retired.size() == 1);
  CHECK_THAT(retired.front(), ContainsSubstring("it was lost 2 times in a row") &&
                                  ContainsSubstring("CL_INVALID_COMMAND_QUEUE (-36)"));
  for (const batch::EntryStatus& status : batch::read_batch(folder.path(), false)) {
    CHECK(status.state == batch::EntryState::done);
    CHECK(status.device == "good");
  }
}

TEST_CASE("an entry that a device has failed at goes to an idle one") {
  for (int i = 0; i < 10; ++i) {  // who is first differs
    const TemporaryFolder folder;
    const batch::Manifest manifest = manifest_of({"a"});
    const batch::BatchOptions options = options_for(folder);
    const auto lock = batch::prepare_batch(manifest, options);
    batch::run_batch(manifest,
                     {device("broken",
                             [](const auto& entry, const auto& path, const auto& monitor) {
                               // Slow enough for the other to ask for work.
                               std::this_thread::sleep_for(std::chrono::milliseconds(100));
                               return broken(entry, path, monitor);
                             }),
                      device("good", write_map)},
                     options);
    CHECK(status_of(folder, "a").state == batch::EntryState::done);
    CHECK(status_of(folder, "a").failed_tries.size() <= 1);
  }
}

TEST_CASE("an entry that every device fails at has failed; the device goes on") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"huge", "a", "b"});
  const auto worked_on = run(manifest, options_for(folder),
                             [](const auto& entry, const auto& path, const auto& monitor) {
                               return entry.name == "huge" ? broken(entry, path, monitor)
                                                           : write_map(entry, path, monitor);
                             });
  CHECK(status_of(folder, "huge").state == batch::EntryState::failed);
  CHECK(status_of(folder, "huge").failed_tries.size() == 3);
  CHECK_THAT(status_of(folder, "huge").error, ContainsSubstring("CL_OUT_OF_RESOURCES"));
  CHECK(status_of(folder, "a").state == batch::EntryState::done);
  CHECK(status_of(folder, "b").state == batch::EntryState::done);
  // The others come before it is tried again.
  CHECK(worked_on == std::vector<std::string>{"huge", "a", "b", "huge", "huge"});
}

TEST_CASE("with no device left entries wait for another run") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b", "c", "d"});
  run(manifest, options_for(folder), broken);
  for (const batch::EntryStatus& status : batch::read_batch(folder.path(), false)) {
    CHECK(status.state == batch::EntryState::waiting);
  }
  CHECK(run(manifest, options_for(folder, true)).size() == 4);
}

TEST_CASE("a stop request ends the entry that runs and begins no other") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b"});
  const batch::BatchOptions options = options_for(folder);
  batch::prepare_batch(manifest, options);
  std::stop_source stop;
  batch::run_batch(
      manifest,
      {device("one",
              [&](const auto&, const auto&, const auto& monitor) -> batch::EntryResult {
                stop.request_stop();
                if (monitor.stop.stop_requested()) throw Interrupted();
                return {};
              })},
      options, {}, stop.get_token());
  CHECK(status_of(folder, "a").state == batch::EntryState::interrupted);
  CHECK(status_of(folder, "b").state == batch::EntryState::waiting);
  CHECK(run(manifest, options_for(folder, true)).size() == 2);
}

TEST_CASE("memory that does not suffice fails the entry") {
  const TemporaryFolder folder;
  run(manifest_of({"a"}), options_for(folder),
      [](const auto&, const auto&, const auto&) -> batch::EntryResult { throw std::bad_alloc(); });
  CHECK_THAT(status_of(folder, "a").error, ContainsSubstring("out of memory"));
}

TEST_CASE("an entry that a failing thread has is done by another") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b", "c", "d"});
  batch::BatchOptions options = options_for(folder);
  const auto lock = batch::prepare_batch(manifest, options);
  std::atomic<bool> has_failed = false;
  const auto fails_once = [&](const batch::BatchEvent& event) {
    if (event.kind == batch::BatchEvent::Kind::started && !has_failed.exchange(true)) {
      throw 1;  // what no thread expects
    }
  };
  CHECK_THROWS_AS(batch::run_batch(manifest, {device("one", write_map), device("two", write_map)},
                                   options, fails_once),
                  int);
  for (const batch::EntryStatus& status : batch::read_batch(folder.path(), false)) {
    CHECK(status.state == batch::EntryState::done);
  }
}

TEST_CASE("a batch whose bookkeeping fails ends, and its threads with it") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b", "c", "d"});
  const batch::BatchOptions options = options_for(folder);
  const auto lock = batch::prepare_batch(manifest, options);
  const auto fails = [](const batch::BatchEvent& event) {
    if (event.kind == batch::BatchEvent::Kind::done) throw std::bad_alloc();
  };
  CHECK_THROWS_AS(batch::run_batch(manifest, {device("one", write_map), device("two", write_map)},
                                   options, fails),
                  std::bad_alloc);
}

TEST_CASE("a key that cannot be made fails its entry alone") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b", "c"});
  batch::BatchOptions options = options_for(folder);
  options.key = [](const batch::BatchEntry& entry) {
    if (entry.name == "b") throw std::bad_alloc();
    return batch::FitKey{};
  };
  const auto lock = batch::prepare_batch(manifest, options);
  batch::run_batch(manifest, {device("one", write_map)}, options);
  CHECK(status_of(folder, "a").state == batch::EntryState::done);
  CHECK_THAT(status_of(folder, "b").error, ContainsSubstring("out of memory"));
  CHECK(status_of(folder, "c").state == batch::EntryState::done);
}

TEST_CASE("what cannot be written down is handed back") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "b.status.json");
  const batch::Manifest manifest = manifest_of({"a", "b", "c"});
  batch::BatchOptions options = options_for(folder, true);
  const auto lock = batch::prepare_batch(manifest, options);
  const auto unsaved = batch::run_batch(manifest, {device("one", write_map)}, options);
  REQUIRE(unsaved.size() == 1);
  CHECK(unsaved[0].name == "b");
  CHECK(unsaved[0].state == batch::EntryState::failed);
  CHECK_THAT(unsaved[0].error, ContainsSubstring("b.status.json"));
  CHECK(status_of(folder, "c").state == batch::EntryState::done);
}

namespace {

/// A rank that is a thread of the test.
class BatchRankThread final : public batch::BatchRanks {
 public:
  BatchRankThread(qjulia::test::RankTable& table, int rank) : ranks_(table, rank) {}
  int rank() const override { return ranks_.rank(); }
  int size() const override { return ranks_.size(); }
  std::vector<std::optional<std::string>> exchange(const std::string& mine) override {
    std::vector<std::optional<std::string>> said;
    for (const auto& numbers : ranks_.all_gather(Ranks::numbers_of(mine))) {
      said.emplace_back(Ranks::bytes_of(numbers));
    }
    return said;
  }
  std::chrono::milliseconds patience() const override { return std::chrono::minutes(1); }

 private:
  qjulia::test::RankThread ranks_;
};

/// Rank 0, with a rank 1 that asks for an entry, and from the tenth round on says nothing.
class RankBesideLost final : public batch::BatchRanks {
 public:
  int rank() const override { return 0; }
  int size() const override { return 2; }
  std::vector<std::optional<std::string>> exchange(const std::string& mine) override {
    batch::RoundMessage message{1, true, {}, {}};
    if (round_ == 0) message.requests.push_back({0, {}});
    if (++round_ < 10) return {mine, packed(message)};
    return {mine, std::nullopt};
  }
  std::chrono::milliseconds patience() const override { return std::chrono::minutes(1); }

 private:
  int round_ = 0;
};

/// Rank 1 of two, whose process is stopped when `is_stopped` is set, until `is_awake` is, and which
/// hears one round after that that it was given up: the last message of the others was under way.
class RankThatStops final : public batch::BatchRanks {
 public:
  std::atomic<bool> is_stopped = false, is_awake = false;
  std::atomic<int> rounds = 0;

  int rank() const override { return 1; }
  int size() const override { return 2; }
  std::vector<std::optional<std::string>> exchange(const std::string& mine) override {
    ++rounds;
    if (was_stopped_) throw Error("given up");
    if (is_stopped) {
      while (!is_awake) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      was_stopped_ = true;
    }
    // Rank 0 has no runners.
    return {packed(batch::RoundMessage{0, true, {}, {}}), mine};
  }
  std::chrono::milliseconds patience() const override { return std::chrono::milliseconds(400); }

 private:
  bool was_stopped_ = false;
};

}  // namespace

TEST_CASE("a shard is read, and what a scheduler says of it") {
  CHECK(batch::shard_of("2/3") == batch::Shard{2, 3});
  for (const char* wrong : {"", "2", "0/3", "4/3", "2/", "/3", "-1/3", "1/3x", "1/100001"}) {
    CHECK_THROWS_WITH(batch::shard_of(wrong), ContainsSubstring("give I/N"));
  }
  CHECK(batch::shard_file("x/e.b.jsonl", {2, 3}) == "x/e.b-2-of-3.jsonl");
  using Variables = std::map<std::string, std::string>;
  const auto said = [](const Variables& variables) {
    return batch::scheduled_shard([&](const char* name) {
      const auto found = variables.find(name);
      return found == variables.end() ? nullptr : found->second.c_str();
    });
  };
  const auto slurm = [&](const char* id, const char* first, const char* last, const char* count) {
    return said({{"SLURM_ARRAY_TASK_ID", id},
                 {"SLURM_ARRAY_TASK_MIN", first},
                 {"SLURM_ARRAY_TASK_MAX", last},
                 {"SLURM_ARRAY_TASK_COUNT", count}});
  };
  CHECK_FALSE(said({}));
  CHECK(slurm("0", "0", "2", "3")->shard == batch::Shard{1, 3});
  CHECK(slurm("3", "1", "3", "3")->shard == batch::Shard{3, 3});
  using Array = std::array<const char*, 4>;
  for (const auto& [id, first, last, count] :
       {Array{"2", "2", "2", "1"}, Array{"2", "2", "4", "2"}, Array{"8", "0", "8", "3"},
        Array{"4", "1", "3", "3"}, Array{"1", "1", "2", "3"}, Array{"1", "1", "1", "1"}}) {
    CHECK_THROWS_WITH(slurm(id, first, last, count), ContainsSubstring("give --shard I/N"));
  }
  CHECK_THROWS_WITH(said({{"SLURM_ARRAY_TASK_ID", "1"}}), ContainsSubstring("--shard 1/1"));
  CHECK_THROWS_WITH(said({{"PBS_ARRAY_INDEX", "1"}}),
                    ContainsSubstring("give --shard $PBS_ARRAY_INDEX/N"));
}

TEST_CASE("shards make the entries of the undivided batch, in its order") {
  const TemporaryFolder folder;
  const auto run_shard = [&](std::size_t number) {
    batch::Manifest manifest = manifest_of({"e", "d", "c", "b", "a"});
    batch::keep_shard(manifest, {number, 2});
    batch::BatchOptions options = options_for(folder);
    options.folder = batch::shard_folder(folder.path(), {number, 2});
    const auto lock = batch::prepare_batch(manifest, options);
    batch::run_batch(manifest, {device("here", write_map)}, options);
  };
  CHECK_THROWS_WITH(batch::merge_shards(folder.path()), ContainsSubstring("holds no shards"));
  run_shard(2);
  CHECK_THROWS_WITH(batch::merge_shards(folder.path()), ContainsSubstring("lacks shard 1 of 2"));
  run_shard(1);
  for (int times = 0; times < 2; ++times) {
    std::string names;
    for (const batch::EntryStatus& entry : batch::merge_shards(folder.path())) {
      CHECK(entry.state == batch::EntryState::done);
      for (const std::string& file : entry.files) {
        CHECK(std::filesystem::exists(folder.path() / file));
      }
      names += entry.name;
    }
    CHECK(names == "edcba");
  }
  CHECK(batch::read_batch(folder.path(), false).size() == 5);
  batch::check_division(folder.path(), {2, 2});
  CHECK_THROWS_WITH(batch::check_division(folder.path(), {1, 3}),
                    ContainsSubstring("shard of another division than 1/3"));
  const auto first = folder.path() / "shard-1-of-2", copy = folder.path() / "shard-1-of-2.old";
  std::filesystem::copy(first, copy);
  CHECK_THROWS_WITH(batch::merge_shards(folder.path()),
                    ContainsSubstring("are the same shard") && ContainsSubstring(copy.string()));
  std::filesystem::remove_all(copy);
  const auto refuses = [&](const std::string& file, const std::string& from, const std::string& to,
                           const std::string& why) {
    const std::string name = "shard-1-of-2/" + file, text = read_text(folder / name);
    std::string wrong = text;
    REQUIRE(wrong.find(from) != std::string::npos);
    wrong.replace(wrong.find(from), from.size(), to);
    folder.file(name, wrong);
    CHECK_THROWS_WITH(batch::merge_shards(folder.path()), ContainsSubstring(why));
    folder.file(name, text);
  };
  refuses("e.status.json", "\"name\": \"e\"", "\"name\": \"../evil\"", "in the status of 'e'");
  refuses("batch.json", "\"name\": \"c\"", "\"name\": \"e\"", "5 of 5 entries, with 4 names");
  refuses("batch.json", "\"entries\": 5", "\"entries\": 6", "5 of 6 entries");
  refuses("batch.json", "\"manifest_hash\": \"", "\"manifest_hash\": \"0", "another batch");
  const auto status = folder.path() / "shard-1-of-2/e.status.json";
  std::filesystem::rename(status, status.string() + ".kept");
  std::filesystem::create_directory(status);  // what cannot be read is not taken for undone
  CHECK_THROWS_WITH(batch::merge_shards(folder.path()), ContainsSubstring("e.status.json"));
  std::filesystem::remove(status);
  std::filesystem::rename(status.string() + ".kept", status);
  std::filesystem::rename(folder.path() / "shard-2-of-2", folder.path() / "shard-9-of-9");
  CHECK(batch::merge_shards(folder.path()).size() == 5);  // the folder's file says which it is
  folder.file("shard-9-of-9/batch.json", "{\"entries\": []}");
  CHECK_THROWS_WITH(batch::merge_shards(folder.path()), ContainsSubstring("is no shard"));
}

TEST_CASE("events are lines of JSON, and progress comes once a second") {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "e.jsonl";
  batch::EntryStatus status;
  status.name = "a\nb\xff";
  status.energy = std::nan("");
  using Kind = batch::BatchEvent::Kind;
  {
    batch::EventLog log(file, false, 3);
    for (const Kind kind : {Kind::started, Kind::progress, Kind::progress, Kind::done}) {
      log.write({.kind = kind, .status = &status, .device = "d"});
    }
    log.write({.kind = Kind::done, .elsewhere = true, .status = &status});
    log.write({.kind = Kind::rank_lost, .device = "rank 1", .message = "gone"});
    CHECK_FALSE(log.has_failed());
  }
  batch::EventLog(file, true, 0).write("batch_ended", {{"done", 1}});
  std::istringstream lines(read_text(file));
  std::string line;
  std::string events;
  while (std::getline(lines, line)) {
    const auto event = nlohmann::json::parse(line);
    events += event.at("event").get<std::string>() + " ";
    CHECK(event.at("time").get<std::string>().size() ==
          std::string("2026-01-02T03:04:05.678Z").size());
    if (event.contains("energy")) CHECK(event["energy"].is_null());
  }
  CHECK(events == "started progress done rank_lost batch_ended ");
  CHECK_THROWS_AS(batch::EventLog(folder.path() / "no/such/file", false, 0), OutputError);
}

TEST_CASE("metrics are in Prometheus's text format") {
  batch::EntryStatus status;
  status.name = "a\"b\\c\n";
  status.state = batch::EntryState::running;
  status.seconds = 1.5;
  status.energy = 0.25;
  const std::string text =
      batch::metrics_text({{status.name, {status}}, {"other", {{}, true}}}, 3, 12.5, {});
  const std::string label = R"({entry="a\"b\\c\n",state="running"})";
  CHECK_THAT(text, ContainsSubstring("# TYPE qjulia_batch_entries gauge\n"));
  CHECK_THAT(text, ContainsSubstring("qjulia_batch_entries{state=\"waiting\"} 2\n"));
  CHECK_THAT(text, ContainsSubstring("qjulia_batch_entries{state=\"running\"} 1\n"));
  CHECK_THAT(text, ContainsSubstring("qjulia_batch_entry_seconds" + label + " 1.5\n"));
  CHECK_THAT(text, ContainsSubstring("qjulia_batch_entry_energy" + label + " 0.25\n"));
  CHECK_THAT(text, !ContainsSubstring("memory_bytes{"));  // not known
  CHECK_THAT(text, !ContainsSubstring("other"));          // only its state is known
  CHECK_THAT(text, ContainsSubstring("qjulia_batch_time_seconds 12.500\n"));
  const std::string of_shard = batch::metrics_text({{"a", {status}}}, 3, 12.5, batch::Shard{2, 3});
  for (const char* line : {R"(entries{state="waiting",shard="2/3"} 2)",
                           R"(entry_seconds{entry="a",state="running",shard="2/3"} 1.5)",
                           R"(time_seconds{shard="2/3"} 12.500)"}) {
    CHECK_THAT(of_shard, ContainsSubstring(std::string("qjulia_batch_") + line + "\n"));
  }
}

TEST_CASE("an entry that begins leaves the most memory of one that runs") {
  const TemporaryFolder folder;
  constexpr std::size_t kBytes = std::size_t{256} << 20;
  std::latch has_allocated(1), has_begun_third(1);
  const auto work = [&](const batch::BatchEntry& entry, const std::filesystem::path& into,
                        const ProgressMonitor& monitor) {
    if (entry.name == "a") {
      // Every byte is written, so that it counts.
      std::make_unique<std::vector<char>>(kBytes, 'a').reset();
      has_allocated.count_down();
      has_begun_third.wait();
    }
    if (entry.name == "b") has_allocated.wait();
    if (entry.name == "c") has_begun_third.count_down();
    return write_map(entry, into, monitor);
  };
  const batch::Manifest manifest = manifest_of({"a", "b", "c"});
  const batch::BatchOptions options = options_for(folder);
  const auto lock = batch::prepare_batch(manifest, options);
  batch::run_batch(manifest, {device("one", work), device("two", work)}, options);
  CHECK(status_of(folder, "a").memory_bytes >= kBytes);
}

TEST_CASE("entries of a lost rank are done by others") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b", "c"});
  const batch::BatchOptions options = options_for(folder);
  const auto lock = batch::prepare_batch(manifest, options);
  RankBesideLost ranks;
  std::vector<std::string> lost;
  std::set<std::string> done;
  const auto worker = device("here", [](const auto& entry, const auto& path, const auto& monitor) {
    return write_map(entry, path, monitor);
  });
  batch::run_batch(
      manifest, {worker}, options,
      [&](const batch::BatchEvent& event) {
        if (event.kind == batch::BatchEvent::Kind::rank_lost) {
          lost.push_back(event.device + ": " + event.message);
        }
        if (event.kind == batch::BatchEvent::Kind::done) done.insert(event.status->name);
      },
      {}, &ranks);
  CHECK(done == std::set<std::string>{"a", "b", "c"});
  REQUIRE(lost.size() == 1);  // told once
  CHECK_THAT(lost.front(), Catch::Matchers::StartsWith("rank 1: others do "));
}

TEST_CASE("a batch writes down the joules of its entries") {
  const TemporaryFolder folder;
  folder.file("energy", "1000000");
  batch::BatchDevice one = device("one", [&](const auto& entry, const auto& path, const auto& m) {
    folder.file("energy", entry.name == "a" ? "3500000" : "4000000");
    return write_map(entry, path, m);
  });
  one.energy = std::make_shared<batch::EnergyMeter>(
      std::vector<batch::EnergyCounter>{{folder.path() / "energy", 0}});
  const batch::Manifest manifest = manifest_of({"a", "b"});
  const batch::BatchOptions options = options_for(folder);
  const auto lock = batch::prepare_batch(manifest, options);
  batch::run_batch(manifest, {one}, options);
  CHECK(status_of(folder, "a").joules == 2.5);
  CHECK(status_of(folder, "b").joules == 0.5);
  one.energy = nullptr;
  batch::run_batch(manifest, {one}, options);
  CHECK_FALSE(status_of(folder, "a").joules);
}

TEST_CASE("a rank that goes on after it was given up writes nothing more") {
  using namespace std::chrono_literals;
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a"});
  const batch::BatchOptions options = options_for(folder);
  const auto lock = batch::prepare_batch(manifest, options);
  RankThatStops ranks;
  const auto worker = device("here", [&](const auto& entry, const auto& path, const auto& monitor) {
    base::write_file(path / "early", "");
    ranks.is_stopped = true;
    std::this_thread::sleep_for(500ms);  // longer than others wait
    folder.file("a.status.json", "another rank's");
    ranks.is_awake = true;
    base::write_file(path / "late", "");
    return write_map(entry, path, monitor);
  });
  std::string events;
  const auto observe = [&](const batch::BatchEvent& event) {
    events += std::to_string(static_cast<int>(event.kind));
  };
  CHECK_THROWS_WITH(batch::run_batch(manifest, {worker}, options, observe, {}, &ranks), "given up");
  CHECK(std::filesystem::exists(folder.path() / "early"));
  CHECK_FALSE(std::filesystem::exists(folder.path() / "late"));
  CHECK(read_text(folder / "a.status.json") == "another rank's");
  CHECK(events == std::to_string(static_cast<int>(batch::BatchEvent::Kind::started)));
}

TEST_CASE("a rank that reads meshes for long joins the rounds meanwhile") {
  using namespace std::chrono_literals;
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b"});
  batch::BatchOptions options = options_for(folder, true);
  RankThatStops ranks;
  {
    const auto lock = batch::prepare_batch(manifest, options);
    batch::run_batch(manifest, {device("first", write_map)}, options, {}, {}, &ranks);
  }
  const auto lock = batch::prepare_batch(manifest, options);
  RankThatStops busy;
  bool are_rounds_on = false;
  options.key = [&, key = options.key](const batch::BatchEntry& entry) {
    const int before = busy.rounds;
    for (int waits = 0; waits < 10'000 && busy.rounds < before + 3; ++waits) {
      std::this_thread::sleep_for(1ms);
    }
    are_rounds_on = busy.rounds >= before + 3;
    return key(entry);
  };
  std::set<std::string> done;
  const auto observe = [&](const batch::BatchEvent& event) {
    if (event.kind == batch::BatchEvent::Kind::done && event.earlier)
      done.insert(event.status->name);
  };
  batch::run_batch(manifest, {device("second", write_map)}, options, observe, {}, &busy);
  CHECK(are_rounds_on);
  CHECK(done == std::set<std::string>{"b"});  // its share of two ranks
}

TEST_CASE("each entry is done once by ranks that share a folder") {
  const TemporaryFolder folder;
  std::vector<std::string> names;
  for (int i = 0; i < 60; ++i) names.push_back("entry" + std::to_string(i));
  const batch::Manifest manifest = manifest_of(names);
  const batch::BatchOptions options = options_for(folder, true);
  const auto lock = batch::prepare_batch(manifest, options);
  // The device of one rank never works.
  const auto work = [&](const std::string& who) {
    return device(who,
                  [who](const batch::BatchEntry& entry, const auto& path, const auto& monitor) {
                    // Appended to: a second visit would show.
                    std::ofstream(path / (entry.name + ".visits"), std::ios::app) << who << '\n';
                    std::this_thread::sleep_for(std::chrono::milliseconds(5));
                    return write_map(entry, path, monitor);
                  });
  };
  constexpr int kRanks = 3;
  qjulia::test::RankTable table(kRanks);
  std::atomic<int> settled = 0;
  {
    std::vector<std::jthread> ranks;
    for (int rank = 0; rank < kRanks; ++rank) {
      ranks.emplace_back([&, rank] {
        BatchRankThread thread(table, rank);
        const std::string who(1, static_cast<char>('p' + rank));
        const std::vector<batch::BatchDevice> devices =
            rank == 2 ? std::vector{device("broken", broken)} : std::vector{work(who), work(who)};
        batch::run_batch(
            manifest, devices, options,
            [&](const batch::BatchEvent& event) {
              if (event.kind == batch::BatchEvent::Kind::done && event.status != nullptr) ++settled;
            },
            {}, &thread);
      });
    }
  }
  CHECK(settled == 60 * kRanks);  // every rank is told of every entry
  std::set<std::string> workers;
  for (const std::string& name : names) {
    const std::string visits = read_text(folder.path() / (name + ".visits"));
    CHECK(visits.size() == 2);
    workers.insert(visits);
  }
  CHECK(workers == std::set<std::string>{"p\n", "q\n"});
}

TEST_CASE("a round's message arrives as it was sent, and other bytes are refused") {
  const std::size_t far = std::size_t{1} << 40;
  const batch::RoundMessage sent{
      300,
      true,
      {{far, batch::EntryState::done}, {7, batch::EntryState::interrupted}},
      {{0, {}}, {299, {0, 3, far}}}};
  // As the ranks exchange it.
  const qjulia::Ranks::Numbers numbers = qjulia::Ranks::numbers_of(packed(sent));
  CHECK(batch::unpacked(qjulia::Ranks::bytes_of(numbers)) == sent);
  CHECK(batch::unpacked(packed(batch::RoundMessage{})) == batch::RoundMessage{});

  const std::string bytes = packed(sent);
  const batch::RoundMessage unknown{1, true, {{7, static_cast<batch::EntryState>(77)}}, {}};
  for (const std::string& broken :
       {std::string(), std::string("x"), bytes.substr(0, bytes.size() / 2), packed(unknown)}) {
    CHECK_THROWS_WITH(batch::unpacked(broken), ContainsSubstring("the same version"));
  }
}

TEST_CASE("an entry is given to one thread, however slowly it wakes") {
  const TemporaryFolder folder;
  std::vector<std::string> names;
  for (int i = 0; i < 400; ++i) names.push_back("entry" + std::to_string(i));
  const batch::Manifest manifest = manifest_of(names);
  const batch::BatchOptions options = options_for(folder);
  const auto lock = batch::prepare_batch(manifest, options);
  const auto nothing = [](const auto&, const auto&, const auto&) { return batch::EntryResult{}; };
  std::atomic<int> done = 0;
  // Many more threads than cores: some wake only after the next round.
  const std::vector devices(48, device("quick", nothing));
  batch::run_batch(manifest, devices, options, [&](const batch::BatchEvent& event) {
    if (event.kind == batch::BatchEvent::Kind::done) ++done;
  });
  CHECK(done == 400);
}

TEST_CASE("what a killed process worked on is done by the next") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a", "b"});
  const batch::BatchOptions options = options_for(folder);
  const pid_t child = ::fork();
  if (child == 0) {
    const auto lock = batch::prepare_batch(manifest, options);
    batch::run_batch(manifest,
                     {device("one",
                             [](const auto& entry, const auto& path, const auto& monitor) {
                               if (entry.name == "b") ::raise(SIGKILL);
                               return write_map(entry, path, monitor);
                             })},
                     options);
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  const std::string left = "b.qjulia.json.qjulia-0123456789abcdef.tmp";
  folder.file(left, "half a m");
  folder.file("mine.12345.tmp", "somebody else's");
  CHECK_FALSE(batch::is_locked(folder.path()));
  CHECK(status_of(folder, "a").state == batch::EntryState::done);
  CHECK(status_of(folder, "b").state == batch::EntryState::lost);
  CHECK(batch::read_batch(folder.path(), true)[1].state == batch::EntryState::running);
  CHECK(run(manifest, options_for(folder, true)) == std::vector<std::string>{"b"});
  CHECK(status_of(folder, "b").state == batch::EntryState::done);
  CHECK_FALSE(std::filesystem::exists(folder / left));
  CHECK(std::filesystem::exists(folder / "mine.12345.tmp"));
}

TEST_CASE("a folder has one owner, and others are told who it is") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a"});
  std::optional<batch::FolderLock> lock(batch::prepare_batch(manifest, options_for(folder)));
  CHECK(batch::is_locked(folder.path()));
  const std::string who =
      "in use by process " + std::to_string(::getpid()) + " on " + batch::host_name() + " since 2";
  for (const bool resume : {false, true}) {
    CHECK_THROWS_WITH(batch::prepare_batch(manifest, options_for(folder, resume)),
                      ContainsSubstring(who));
  }
  // Whoever removes the file that says so does not let another one in.
  std::filesystem::remove(folder / ".lock");
  CHECK(batch::is_locked(folder.path()));
  CHECK_THROWS_WITH(batch::prepare_batch(manifest, options_for(folder)),
                    ContainsSubstring("in use by another process"));
  lock.reset();
  CHECK_FALSE(batch::is_locked(folder.path()));
  CHECK_NOTHROW(batch::prepare_batch(manifest, options_for(folder)));
}

TEST_CASE("who only looks whether a folder is locked keeps no batch out") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a"});
  batch::prepare_batch(manifest, options_for(folder));
  const int file = ::open((folder / ".lock").c_str(), O_RDONLY);
  REQUIRE(::flock(file, LOCK_SH) == 0);
  std::jthread looks([file] {
    std::this_thread::sleep_for(std::chrono::milliseconds(60));
    ::close(file);
  });
  CHECK_NOTHROW(batch::prepare_batch(manifest, options_for(folder)));
}

TEST_CASE("what a batch cannot remove is named") {
  const TemporaryFolder folder;
  const std::string name = GENERATE("a.status.json", "a.checkpoint");
  std::filesystem::create_directories(folder.path() / name / "full");
  CHECK_THROWS_WITH(batch::prepare_batch(manifest_of({"a"}), options_for(folder)),
                    ContainsSubstring("cannot remove") && ContainsSubstring(name) &&
                        ContainsSubstring("check what it is"));
}

TEST_CASE("a batch that would overwrite an input is refused before anything is made") {
  const TemporaryFolder folder;
  folder.file("a.obj", "v 0 0 0");
  const batch::BatchOptions options = options_for(folder);
  batch::Manifest manifest = manifest_of({"a"});
  manifest.file = folder.file("m.toml", "");
  manifest.entries[0].mesh = folder / "a.obj";
  const auto count = folder.names().size();
  SECTION("its mesh") {
    manifest.entries[0].outputs.surface = batch::EntryJob{"surface", ".obj"};
    CHECK_THROWS_WITH(
        batch::prepare_batch(manifest, options),
        ContainsSubstring("m.toml:1") && ContainsSubstring("would overwrite the input"));
  }
  SECTION("the mesh of another entry, by a link") {
    std::filesystem::create_hard_link(folder / "a.obj", folder / "b.ply");
    manifest.entries.push_back({"b", folder / "a.obj", {}, {}, 4});
    manifest.entries[1].outputs.surface = batch::EntryJob{"surface", ".ply"};
    CHECK_THROWS_AS(batch::prepare_batch(manifest, options), InputError);
    std::filesystem::remove(folder / "b.ply");
  }
  SECTION("the manifest") {
    manifest.file = folder.file("batch.json", "");
    CHECK_THROWS_AS(batch::prepare_batch(manifest, options), InputError);
    std::filesystem::remove(folder / "batch.json");
  }
  CHECK(folder.names().size() == count);
  CHECK(read_text(folder.path() / "a.obj") == "v 0 0 0");
}

TEST_CASE("summaries hold every entry") {
  const TemporaryFolder folder;
  run(manifest_of({"a", "b", "c,\"d\""}), options_for(folder), all_but_b);
  batch::write_summary(folder.path(), batch::read_batch(folder.path(), false));
  const auto json = nlohmann::json::parse(read_text(folder.path() / "summary.json"));
  CHECK(json["counts"]["done"] == 2);
  CHECK(json["counts"]["failed"] == 1);
  CHECK(json["entries"][1]["error"] == "b cannot be read");
  const std::string csv = read_text(folder.path() / "summary.csv");
  CHECK_THAT(csv, ContainsSubstring("b,,b.obj,,failed,"));
  CHECK_THAT(csv, ContainsSubstring("\"c,\"\"d\"\"\","));
  CHECK_THROWS_AS(batch::read_batch(folder / "nowhere", false), InputError);
}

TEST_CASE("an entry whose status cannot be read is waiting, with the reason") {
  const TemporaryFolder folder;
  run(manifest_of({"a", "b"}), options_for(folder));
  std::filesystem::remove(folder / "b.status.json");
  std::filesystem::create_directory(folder / "b.status.json");
  const auto all = batch::read_batch(folder.path(), false);
  CHECK(all[0].state == batch::EntryState::done);
  CHECK(all[1].state == batch::EntryState::waiting);
  CHECK_THAT(all[1].error,
             ContainsSubstring("b.status.json") && ContainsSubstring("it is a folder"));
}

TEST_CASE("the summary has a row for every entry and n, and every option is a column") {
  const TemporaryFolder folder;
  batch::Manifest manifest = manifest_of({"a", "b", "c"});
  manifest.entries[0].outputs.compare = {1, 6};
  manifest.entries[1].outputs.compare = {2, 6};
  batch::BatchOptions options = options_for(folder);
  options.settings = [](const batch::BatchEntry& entry) -> nlohmann::json {
    return {{"seed", entry.line}, {"schedule", "v \"cycles\", long"}, {"mesh_of", entry.name}};
  };
  run(manifest, options, [](const auto& entry, const auto& path, const auto& monitor) {
    if (entry.name == "b") throw InputError("b <fails>");
    batch::EntryResult result = write_map(entry, path, monitor);
    result.figures["warnings"] = {"thin", "open & wide"};
    if (entry.name != "a") return result;
    result.figures["comparisons"] = {{{"iterations", 1}, {"iou", 0.75}, {"limbs", 4}},
                                     {{"iterations", 6}, {"iou", nullptr}}};
    return result;
  });
  const auto entries = batch::read_batch(folder.path(), false);
  const batch::SummaryTable table = batch::summary_table(entries);
  const auto value = [&](std::size_t row, const std::string& column) {
    const auto found = std::ranges::find(table.columns, column);
    REQUIRE(found != table.columns.end());
    return table.rows.at(row).cells.at(static_cast<std::size_t>(found - table.columns.begin()));
  };
  REQUIRE(table.rows.size() == 5);
  for (const auto& row : table.rows) CHECK(row.cells.size() == table.columns.size());
  CHECK(std::set<std::string>(table.columns.begin(), table.columns.end()).size() ==
        table.columns.size());
  CHECK(value(0, "n") == "1");
  CHECK(value(0, "iou") == "0.75");
  CHECK(value(0, "limbs") == "4");
  CHECK(value(0, "map") == "a.qjulia.json");
  CHECK(value(0, "warnings") == "2");
  CHECK(value(0, "fit_energy") == "0.5");
  CHECK(value(0, "seed") == "1");
  CHECK(value(0, "schedule") == "v \"cycles\", long");
  CHECK(value(1, "n") == "6");
  CHECK(value(1, "iou").empty());
  CHECK(value(1, "mesh_of") == "a");
  CHECK(value(2, "n") == "2");
  CHECK(value(2, "state") == "failed");
  CHECK(value(2, "map").empty());
  CHECK(value(3, "n") == "6");
  CHECK(value(3, "error") == "b <fails>");
  CHECK(value(4, "n").empty());
  CHECK(value(4, "name") == "c");

  batch::write_summary(folder.path(), entries);
  const std::string page = read_text(folder.path() / "index.html");
  CHECK_THAT(page, ContainsSubstring("<h2>Warnings and errors</h2>") &&
                       ContainsSubstring("b: b &lt;fails&gt;") &&
                       ContainsSubstring("open &amp; wide") && !ContainsSubstring("<fails>"));
  CHECK_THAT(page, ContainsSubstring("<button type=\"button\">iou</button>"));
  // What all rows share stands below, once.
  CHECK_THAT(page, !ContainsSubstring("<button type=\"button\">schedule</button>") &&
                       ContainsSubstring("<td>schedule</td>"));
}

TEST_CASE("seconds of all runs count those that were stopped") {
  const TemporaryFolder folder;
  const batch::Manifest manifest = manifest_of({"a"});
  std::stop_source stop;
  {
    const batch::BatchOptions options = options_for(folder);
    const auto lock = batch::prepare_batch(manifest, options);
    batch::run_batch(manifest,
                     {device("one",
                             [&](const auto&, const auto&, const auto&) -> batch::EntryResult {
                               std::this_thread::sleep_for(std::chrono::milliseconds(30));
                               stop.request_stop();
                               throw Interrupted();
                             })},
                     options, {}, stop.get_token());
  }
  const double first = status_of(folder, "a").seconds;
  CHECK(first > 0.02);
  run(manifest, options_for(folder, true));
  CHECK(status_of(folder, "a").earlier_seconds == first);
  CHECK(status_of(folder, "a").state == batch::EntryState::done);
  // Another fit has no earlier runs.
  batch::BatchOptions changed = options_for(folder, true);
  changed.key = [](const batch::BatchEntry&) { return batch::FitKey{"inputs", "others"}; };
  run(manifest, changed);
  CHECK(status_of(folder, "a").earlier_seconds == 0);
}
