#pragma once
/// Work on one device for several pages, each after the other.

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "qjulia/base/progress.hpp"

namespace qjulia::explore {

/// What somebody asked for, and waits for.
class Job {
 public:
  enum class End { waits, done, stale, failed };
  /// How long it takes: a picture, or a fit, a mesh, a turntable, in which pictures come between.
  enum class Length { picture, long_job };
  /// Returns the bytes; throws Interrupted soon after its token asks it to stop.
  using Work = std::function<std::string(Job&)>;

  /// Waits so long at most. @return how it ended; `waits` where it has not.
  End wait(std::chrono::milliseconds limit);
  /// The bytes asked for, or what went wrong; after the end.
  const std::string& bytes() const { return bytes_; }
  /// Nobody waits any more.
  void cancel() { stop_.request_stop(); }
  std::stop_token stop() const { return stop_.get_token(); }

  /// The work reports how far it is, and those who wait for it read that as a line, "~0.42 text",
  /// which is empty before the first report.
  void report(const Progress& progress);
  std::string progress() const;

 private:
  friend class Worker;

  Job(std::string client, Length length, Work work)
      : client_(std::move(client)), length_(length), work_(std::move(work)) {}
  void finish(End end, std::string bytes);
  void run();

  std::string client_;
  Length length_;
  Work work_;
  std::stop_source stop_;
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  End end_ = End::waits;
  std::string bytes_, progress_;
};

/// A thread that does what clients ask for, in turn: a client has one job at a time, and what it
/// asks for next ends the one before, so that clients share the device fairly.
class Worker {
 public:
  static constexpr std::size_t kMostJobs = 64;

  Worker() = default;
  ~Worker() { end(); }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// @return none where too many wait, or after `end`.
  std::shared_ptr<Job> ask(const std::string& client, Job::Length length, Job::Work work);
  /// Draws the pictures that wait. For work that takes long, which calls this now and then.
  void draw_waiting();
  /// Cancels what runs, and does no more.
  void end();

 private:
  void run();
  void run(const std::shared_ptr<Job>& job);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::shared_ptr<Job>> waiting_;
  std::vector<std::shared_ptr<Job>> running_;  ///< the last one now; those before wait for it
  bool ends_ = false;
  std::jthread thread_{[this] { run(); }};
};

}  // namespace qjulia::explore
