#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <thread>

#include "base/file_types.hpp"
#include "base/output_check.hpp"
#include "base/output_file.hpp"
#include "base/output_gate.hpp"
#include "base/text.hpp"
#include "batch/batch.hpp"
#include "batch/energy_meter.hpp"
#include "batch/memory.hpp"
#include "batch/queue.hpp"
#include "batch/status.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::batch {
namespace {

using Kind = BatchEvent::Kind;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostTries = 3;        ///< that an entry has when devices fail
constexpr std::size_t kEntriesToRetire = 3;  ///< that a device fails in a row
constexpr int kLossesToRetire = 2;           ///< of a device in a row: opening it anew did not help
constexpr std::chrono::seconds kBetweenStatuses{2};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Whether the device, not the entry, is to blame.
bool is_of_device(const std::exception& error) {
  return dynamic_cast<const DeviceError*>(&error) != nullptr ||
         dynamic_cast<const KernelBuildError*>(&error) != nullptr ||
         dynamic_cast<const NoDeviceError*>(&error) != nullptr;
}

/// The manifest, its meshes and schedules.
std::vector<std::filesystem::path> inputs_of(const Manifest& manifest) {
  std::vector<std::filesystem::path> inputs{manifest.file};
  for (const BatchEntry& entry : manifest.entries) {
    inputs.push_back(entry.mesh);
    for (const ManifestOption& option : entry.options) {
      if (option.name == "schedule" && option.values.front().ends_with(".toml")) {
        inputs.emplace_back(option.values.front());
      }
    }
  }
  return inputs;
}

/// Removes what an earlier run wrote for the entry and this one did not, but no input.
void remove_earlier_files(const Manifest& manifest, const BatchEntry& entry,
                          const std::filesystem::path& folder,
                          const std::vector<std::string>& earlier,
                          const std::vector<std::string>& now) {
  for (const std::string& name : earlier) {
    const std::string extension = base::extension_of(name);
    const bool is_beside_map =
        extension == ".png" || base::has_type(name, base::FileContent::mesh, base::FileUse::write);
    const bool is_own =
        name == entry.name + ".report.html" || (is_beside_map && name == entry.name + extension);
    if (!is_own || std::ranges::find(now, name) != now.end()) continue;
    std::error_code ignored;
    const bool is_input = std::ranges::any_of(inputs_of(manifest), [&](const auto& input) {
      return std::filesystem::equivalent(input, folder / name, ignored);
    });
    if (!is_input) std::filesystem::remove(folder / name, ignored);
  }
}

/// One device's thread.
struct Runner {
  std::size_t number;
  const Manifest& manifest;
  const BatchDevice& device;
  const BatchOptions& options;
  Queue& queue;
  const std::function<void(const BatchEvent&)>& observe;
  const std::stop_token stop;
  std::atomic<int>& running;  ///< entries, of all runners
  BatchWorker worker{};
  std::set<std::size_t> failed_here{};
  std::set<std::size_t> failed_in_a_row{};
  int losses_in_a_row = 0;

  void run() {
    while (const auto index = queue.next(number, failed_here, stop)) {
      if (!run_entry(*index)) return;
    }
  }

  /// @return whether the device stays in use.
  bool run_entry(std::size_t index) {
    // The most memory is the process's: other entries that run need what it has counted.
    if (running.fetch_add(1) == 0) forget_most_memory();
    const bool stays = try_entry(index);
    --running;
    return stays;
  }

  bool try_entry(std::size_t index) {
    const BatchEntry& entry = manifest.entries[index];
    EntryStatus status;
    status.name = entry.name;
    status.mesh = entry.mesh.string();
    const auto start = Clock::now();
    std::optional<EnergyMeter::Account> energy;
    if (device.energy) energy.emplace(*device.energy);
    const auto put_back = [&](EntryState state, std::string error = {}) {
      status.state = state;
      status.error = std::move(error);
      status.memory_bytes = most_memory();
      if (energy) status.joules = energy->joules();
      status.seconds = seconds_since(start);
      status.progress = {};
      if (state == EntryState::failed) status.files.clear();
      queue.put_back(number, index, status);
    };
    try {
      begin(index, status);
      if (!worker) worker = device.open();
      EntryResult result = worker(entry, options.folder, monitor(status, start, energy));
      remove_earlier_files(manifest, entry, options.folder, status.files, result.files);
      status.files = std::move(result.files);
      status.figures = std::move(result.figures);
      put_back(EntryState::done);
      failed_in_a_row.clear();
      losses_in_a_row = 0;
    } catch (const Interrupted&) {
      put_back(EntryState::interrupted);
      tell(Kind::interrupted, &status);
    } catch (const std::exception& error) {
      const auto* const of_device = dynamic_cast<const DeviceError*>(&error);
      losses_in_a_row = of_device != nullptr && of_device->is_lost() ? losses_in_a_row + 1 : 0;
      if (is_of_device(error)) return blame_device(index, status, error.what(), put_back);
      put_back(EntryState::failed, base::message_of(error));
    }
    return true;
  }

  void tell(Kind kind, const EntryStatus* status, const std::string& message = {}) {
    observe({.kind = kind, .status = status, .device = device.name, .message = message});
  }

  void begin(std::size_t index, EntryStatus& status) {
    const BatchEntry& entry = manifest.entries[index];
    auto known = read_status(options.folder, entry.name);
    status.key = queue.key_of(index);
    if (known) status.files = std::move(known->files);  // there until others take their place
    if (known && known->state != EntryState::done && known->key == status.key) {
      status.failed_tries = std::move(known->failed_tries);
      status.earlier_seconds = known->earlier_seconds + known->seconds;
    }
    status.settings = settings_of(entry, options);
    status.state = EntryState::running;
    status.host = host_name();
    status.process = ::getpid();
    status.device = device.name;
    status.started = time_stamp();
    write_status(options.folder, status);
    tell(Kind::started, &status);
    if (queue.has_start(index)) return;
    throw Error(fmt::format("the frame before it, '{}', has no map to start from", entry.follows));
  }

  EntryMonitor monitor(EntryStatus& status, Clock::time_point start,
                       std::optional<EnergyMeter::Account>& account) {
    EntryMonitor made;
    made.stop = stop;
    made.on_energy = [&status](double energy) { status.energy = energy; };
    made.on_progress = [this, &status, &account, start,
                        written = start](const Progress& progress) mutable {
      status.progress = progress;
      status.seconds = seconds_since(start);
      tell(Kind::progress, &status);
      if (Clock::now() - written < kBetweenStatuses) return;
      written = Clock::now();
      status.memory_bytes = most_memory();
      if (account) status.joules = account->joules();
      try {
        write_status(options.folder, status);
      } catch (const OutputError&) {
        // Only who looks from outside misses something.
      }
    };
    return made;
  }

  template <class PutBack>
  bool blame_device(std::size_t index, EntryStatus& status, const std::string& why,
                    const PutBack& put_back) {
    worker = nullptr;  // a context that failed once may never work again
    failed_here.insert(index);
    failed_in_a_row.insert(index);
    status.failed_tries.push_back({device.name, why});
    if (status.failed_tries.size() >= kMostTries) {
      put_back(EntryState::failed,
               fmt::format("devices failed {} times, last: {}", kMostTries, why));
    } else {
      put_back(EntryState::waiting, why);
      tell(Kind::given_back, &status, why);
    }
    const bool is_lost = losses_in_a_row >= kLossesToRetire;
    if (failed_in_a_row.size() < kEntriesToRetire && !is_lost) return true;
    tell(Kind::retired, nullptr,
         is_lost ? fmt::format("it was lost {} times in a row: {}", kLossesToRetire, why)
                 : fmt::format("it failed {} entries in a row, last: {}", kEntriesToRetire, why));
    return false;
  }
};

/// Every file that the batch may write.
std::vector<base::Output> outputs_of(const Manifest& manifest,
                                     const std::filesystem::path& folder) {
  std::vector<base::Output> outputs;
  for (const char* name :
       {"batch.json", "summary.json", "summary.csv", "index.html", "contact_sheet.png", ".lock"}) {
    outputs.push_back({"the batch's", folder / name});
  }
  for (const BatchEntry& entry : manifest.entries) {
    std::vector<std::string> endings = {".qjulia.json", ".status.json", ".checkpoint"};
    for (const auto& job : {entry.outputs.surface, entry.outputs.picture}) {
      if (job) endings.push_back(job->extension);
    }
    if (entry.outputs.report) endings.emplace_back(".report.html");
    for (const std::string& ending : endings) {
      outputs.push_back({fmt::format("{}:{}", manifest.file.string(), entry.line),
                         folder / (entry.name + ending)});
    }
  }
  return outputs;
}

/// Removes a file, if it is there.
void remove_file(const std::filesystem::path& file) {
  std::error_code error;
  std::filesystem::remove(file, error);
  if (error) {
    throw OutputError(fmt::format("cannot remove '{}': {}; check what it is, and its folder",
                                  file.string(), error.message()));
  }
}

}  // namespace

FolderLock prepare_batch(const Manifest& manifest, const BatchOptions& options) {
  const auto& folder = options.folder;
  base::check_distinct(inputs_of(manifest), outputs_of(manifest, folder));
  base::make_folder(folder);
  FolderLock lock(folder);
  base::remove_all_leftovers(folder);
  for (const BatchEntry& entry : manifest.entries) {
    const auto status = read_status(folder, entry.name);
    // What is done counts until it begins anew, so that a stopped batch can be resumed.
    const bool forget = options.resume
                            ? options.retry_failed && status && status->state == EntryState::failed
                            : !status || status->state != EntryState::done;
    if (forget) remove_file(status_path(folder, entry.name));
    if (!options.resume) remove_file(folder / (entry.name + ".checkpoint"));
  }
  write_index(manifest, options);
  return lock;
}

std::vector<EntryStatus> run_batch(const Manifest& manifest,
                                   const std::vector<BatchDevice>& devices,
                                   const BatchOptions& options,
                                   const std::function<void(const BatchEvent&)>& observe,
                                   std::stop_token stop, BatchRanks* ranks) {
  std::mutex one_at_a_time;
  const std::function<void(const BatchEvent&)> observer = [&](const BatchEvent& event) {
    const std::lock_guard lock(one_at_a_time);
    if (observe) observe(event);
  };
  const auto tell_settled = [&](const Settled& settled) {
    const EntryStatus& status = settled.status;
    observer({.kind = status.state == EntryState::done ? Kind::done : Kind::failed,
              .earlier = settled.by == Settled::By::earlier_run,
              .elsewhere = settled.by == Settled::By::other_rank,
              .status = &status,
              .device = status.device,
              .message = status.error});
  };
  const auto tell_lost = [&](const LostRank& lost) {
    observer({.kind = Kind::rank_lost,
              .elsewhere = ranks != nullptr && ranks->rank() > 0,  // rank 0 tells of it
              .device = fmt::format("rank {}", lost.rank),
              .message = lost.entries.empty()
                             ? std::string("it had no entry")
                             : fmt::format("others do {}", fmt::join(lost.entries, ", "))});
  };
  Queue queue(manifest, options, ranks, devices.size(), tell_settled, tell_lost);
  // Told of at the end: telling takes memory, and it may be memory that there is too little of.
  std::vector<std::exception_ptr> failures(devices.size());
  std::atomic<int> running = 0;
  std::stop_source end;  // stops the runners: a stop is asked for, or the queue has failed
  const std::stop_callback at_stop(stop, [&] { end.request_stop(); });
  {
    std::vector<std::jthread> threads;
    threads.reserve(devices.size());
    for (std::size_t i = 0; i < devices.size(); ++i) {
      const auto run = [&, i] {
        try {
          const base::OutputGate gate([&] { queue.expect_own_entries(); });
          Runner{i, manifest, devices[i], options, queue, observer, end.get_token(), running}.run();
        } catch (...) {
          failures[i] = std::current_exception();
        }
        queue.leave(i);
      };
      try {
        threads.emplace_back(run);
      } catch (...) {  // those that have begun wait for `queue.run`
        failures[i] = std::current_exception();
        queue.leave(i);
      }
    }
    try {
      queue.run();
    } catch (...) {
      end.request_stop();
      throw;
    }
  }
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (!failures[i]) continue;
    try {
      std::rethrow_exception(failures[i]);
    } catch (const std::exception& error) {
      observer(
          {.kind = Kind::retired, .device = devices[i].name, .message = base::message_of(error)});
    }
  }
  return queue.unsaved();
}

}  // namespace qjulia::batch
