#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <mutex>
#include <new>
#include <set>
#include <thread>

#include "batch/claim.hpp"
#include "batch/queue.hpp"
#include "batch/status.hpp"
#include "qjulia/batch.hpp"
#include "qjulia/error.hpp"

namespace qjulia {
namespace {

using batch::Queue;
using batch::Task;
using Kind = BatchEvent::Kind;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostTries = 3;        ///< of an entry, when devices fail
constexpr std::size_t kEntriesToRetire = 3;  ///< that a device fails in a row
constexpr std::chrono::seconds kBetweenTouches{20};
constexpr std::chrono::seconds kBetweenStatuses{2};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Hands events to the observer one at a time.
class Observer {
 public:
  explicit Observer(const std::function<void(const BatchEvent&)>& observe) : observe_(observe) {}
  void operator()(const BatchEvent& event) {
    const std::lock_guard lock(mutex_);
    if (observe_) observe_(event);
  }

 private:
  const std::function<void(const BatchEvent&)>& observe_;
  std::mutex mutex_;
};

/// One device's thread.
class Runner {
 public:
  Runner(const Manifest& manifest, const BatchDevice& device, const BatchOptions& options,
         Queue& queue, Observer& observe, const std::stop_token& stop)
      : manifest_(manifest),
        device_(device),
        options_(options),
        queue_(queue),
        observe_(observe),
        stop_(stop) {}

  void run() {
    while (auto task = queue_.next(failed_here_, stop_)) {
      if (!run_task(*task)) return;
    }
  }

 private:
  /// @return whether the device stays in use.
  bool run_task(Task& task) {
    EntryStatus& status = task.status;
    const auto start = Clock::now();
    const auto settle = [&](EntryState state, Kind kind, std::string error) {
      status.state = state;
      status.error = std::move(error);
      status.seconds = seconds_since(start);
      status.progress = {};
      queue_.put_back(status, task.index);
      observe_({kind, false, &status, device_.name, status.error});
    };
    try {
      begin(status);
      if (!worker_) worker_ = device_.open();
      EntryResult result =
          worker_->run(manifest_.entries[task.index], options_.folder, watch(status, start));
      status.files = std::move(result.files);
      status.figures = std::move(result.figures);
      settle(EntryState::done, Kind::done, {});
      failed_in_a_row_.clear();
    } catch (const Interrupted&) {
      settle(EntryState::interrupted, Kind::interrupted, {});
    } catch (const DeviceError& error) {
      return device_failed(task, error.what(), settle);
    } catch (const KernelBuildError& error) {
      return device_failed(task, error.what(), settle);
    } catch (const NoDeviceError& error) {
      return device_failed(task, error.what(), settle);
    } catch (const std::bad_alloc&) {
      settle(EntryState::failed, Kind::failed, "out of memory");
    } catch (const std::exception& error) {
      settle(EntryState::failed, Kind::failed, error.what());
    }
    return true;
  }

  void begin(EntryStatus& status) {
    status.state = EntryState::running;
    status.host = batch::host_name();
    status.process = ::getpid();
    status.device = device_.name;
    status.started = batch::time_stamp();
    batch::write_status(options_.folder, status);
    observe_({Kind::started, false, &status, device_.name, {}});
  }

  Watch watch(EntryStatus& status, Clock::time_point start) {
    return {[this, &status, start, written = start](const Progress& progress) mutable {
              status.progress = progress;
              status.seconds = seconds_since(start);
              observe_({Kind::progress, false, &status, device_.name, {}});
              if (Clock::now() - written < kBetweenStatuses) return;
              written = Clock::now();
              try {
                batch::write_status(options_.folder, status);
              } catch (const OutputError&) {
                // Only who looks from outside misses something.
              }
            },
            stop_};
  }

  template <class Settle>
  bool device_failed(Task& task, const std::string& why, const Settle& settle) {
    worker_.reset();  // a context that failed once may never work again
    failed_here_.insert(task.index);
    failed_in_a_row_.insert(task.index);
    task.status.failed_tries.push_back({device_.name, why});
    if (task.status.failed_tries.size() >= kMostTries) {
      settle(EntryState::failed, Kind::failed,
             fmt::format("devices failed {} times, last: {}", kMostTries, why));
    } else {
      settle(EntryState::waiting, Kind::given_back, why);
    }
    if (failed_in_a_row_.size() < kEntriesToRetire) return true;
    observe_({Kind::retired, false, nullptr, device_.name,
              fmt::format("it failed {} entries in a row, last: {}", kEntriesToRetire, why)});
    return false;
  }

  const Manifest& manifest_;
  const BatchDevice& device_;
  const BatchOptions& options_;
  Queue& queue_;
  Observer& observe_;
  const std::stop_token& stop_;
  std::unique_ptr<BatchWorker> worker_;
  std::set<std::size_t> failed_here_;
  std::set<std::size_t> failed_in_a_row_;
};

/// Files that `AtomicFile` of a process that was killed has left: NAME.PROCESS.tmp.
bool is_leftover(const std::filesystem::path& path) {
  if (path.extension() != ".tmp") return false;
  const std::string process = path.stem().extension().string();
  return process.size() > 1 && process.find_first_not_of("0123456789", 1) == std::string::npos;
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!std::filesystem::is_directory(folder)) {
    throw OutputError(
        fmt::format("cannot make the folder '{}': {}", folder.string(), error.message()));
  }
}

}  // namespace

void prepare_batch(const Manifest& manifest, const BatchOptions& options) {
  const auto& folder = options.folder;
  make_folder(folder);
  bool any_living = false;
  for (const BatchEntry& entry : manifest.entries) {
    if (batch::break_dead_claim(batch::claim_path(folder, entry.name))) continue;
    any_living = true;
    if (options.resume) continue;
    throw InputError(fmt::format(
        "'{}' is being worked on in '{}' by another process; wait for it, join it with --resume, "
        "or choose another folder",
        entry.name, folder.string()));
  }
  const batch::FolderLock lock(folder);
  if (!any_living) {
    std::vector<std::filesystem::path> leftovers;
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
      if (is_leftover(file.path())) leftovers.push_back(file.path());
    }
    for (const auto& path : leftovers) std::filesystem::remove(path);
  }
  for (const BatchEntry& entry : manifest.entries) {
    const auto status = batch::read_status(folder, entry.name);
    const bool forget =
        !options.resume || (options.retry_failed && status && status->state == EntryState::failed);
    if (forget) std::filesystem::remove(batch::status_path(folder, entry.name));
  }
  batch::write_index(folder, manifest);
}

std::vector<EntryStatus> run_batch(const Manifest& manifest,
                                   const std::vector<BatchDevice>& devices,
                                   const BatchOptions& options,
                                   const std::function<void(const BatchEvent&)>& observe,
                                   std::stop_token stop) {
  Observer observer(observe);
  Queue queue(manifest, options, [&](const EntryStatus& status) {
    const Kind kind = status.state == EntryState::done ? Kind::done : Kind::failed;
    observer({kind, true, &status, status.device, status.error});
  });
  const std::jthread heartbeat([&queue](const std::stop_token& ended) {
    std::mutex mutex;
    std::condition_variable_any never;
    std::unique_lock lock(mutex);
    while (!never.wait_for(lock, ended, kBetweenTouches, [] { return false; }) &&
           !ended.stop_requested()) {
      queue.touch_claims();
    }
  });
  {
    std::vector<std::jthread> threads;
    threads.reserve(devices.size());
    for (const BatchDevice& device : devices) {
      threads.emplace_back(
          [&, stop] { Runner(manifest, device, options, queue, observer, stop).run(); });
    }
  }
  return queue.unsaved();
}

}  // namespace qjulia
