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

namespace qjulia::explore {

/// What somebody asked for, and waits for.
class Job {
 public:
  enum class End { waits, done, stale, failed };

  /// Waits so long at most. @return how it ended; `waits` where it has not.
  End wait(std::chrono::milliseconds limit);
  /// The bytes asked for, or what went wrong; after the end.
  const std::string& bytes() const { return bytes_; }
  /// Nobody waits any more.
  void cancel() { stop_.request_stop(); }

 private:
  friend class Worker;
  using Work = std::function<std::string(const std::stop_token&)>;

  Job(std::string client, Work work) : client_(std::move(client)), work_(std::move(work)) {}
  void finish(End end, std::string bytes);

  std::string client_;
  Work work_;
  std::stop_source stop_;
  std::mutex mutex_;
  std::condition_variable ended_;
  End end_ = End::waits;
  std::string bytes_;
};

/// A thread that does what clients ask for, in turn: a client has one job at a time, and what it
/// asks for next ends the one before, so that clients share the device fairly.
class Worker {
 public:
  static constexpr std::size_t kMostJobs = 64;

  Worker();
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// @param work returns the bytes; throws Interrupted soon after its token asks it to stop.
  /// @return none where too many wait, or after `end`.
  std::shared_ptr<Job> ask(const std::string& client, Job::Work work);
  /// Cancels what runs, and does no more.
  void end();

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::shared_ptr<Job>> waiting_;
  std::shared_ptr<Job> running_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace qjulia::explore
