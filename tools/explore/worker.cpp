#include "explore/worker.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "explore/request.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::explore {

Job::End Job::wait(std::chrono::milliseconds limit) {
  std::unique_lock lock(mutex_);
  ended_.wait_for(lock, limit, [&] { return end_ != End::waits; });
  return end_;
}

void Job::finish(End end, std::string bytes) {
  {
    const std::lock_guard lock(mutex_);
    end_ = end;
    bytes_ = std::move(bytes);
  }
  ended_.notify_all();
}

void Job::report(const Progress& progress) {
  const std::lock_guard lock(mutex_);
  progress_ = fmt::format("~{:.3f} {}\n", progress.fraction, progress.detail);
}

std::string Job::progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

void Job::run() {
  try {
    throw_if_stopped(stop());
    finish(End::done, work_(*this));
  } catch (const Interrupted&) {
    finish(End::stale, {});
  } catch (const OptionError& error) {
    finish(End::failed, message_of(error));
  } catch (const std::exception& error) {
    finish(End::failed, error.what());
  }
}

void Worker::end() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    for (const auto& job : running_) job->cancel();
  }
  changed_.notify_all();
}

std::shared_ptr<Job> Worker::ask(const std::string& client, Job::Length length, Job::Work work) {
  std::shared_ptr<Job> job(new Job(client, length, std::move(work)));
  std::vector<std::shared_ptr<Job>> stale;
  {
    const std::lock_guard lock(mutex_);
    const auto is_same = [&](const auto& other) {
      return other->client_ == client && other->length_ == length;
    };
    std::ranges::copy_if(waiting_, std::back_inserter(stale), is_same);
    std::erase_if(waiting_, is_same);
    for (const auto& other : running_) {
      if (is_same(other)) other->cancel();
    }
    if (!ends_ && waiting_.size() < kMostJobs)
      waiting_.push_back(job);
    else
      job = nullptr;
  }
  for (const auto& other : stale) other->finish(Job::End::stale, {});
  changed_.notify_all();
  return job;
}

void Worker::run(const std::shared_ptr<Job>& job) {
  job->run();
  const std::lock_guard lock(mutex_);
  running_.pop_back();
}

void Worker::draw_waiting() {
  std::deque<std::shared_ptr<Job>> pictures;
  {
    const std::lock_guard lock(mutex_);
    const auto is_picture = [](const auto& job) { return job->length_ == Job::Length::picture; };
    std::ranges::copy_if(waiting_, std::back_inserter(pictures), is_picture);
  }
  // Those that come meanwhile wait for the next call: the work goes on in between.
  for (const auto& job : pictures) {
    {
      const std::lock_guard lock(mutex_);
      if (ends_) return;
      if (std::erase(waiting_, job) == 0) continue;  // cancelled meanwhile
      running_.push_back(job);
    }
    run(job);
  }
}

void Worker::run() {
  for (;;) {
    std::shared_ptr<Job> job;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return ends_ || !waiting_.empty(); });
      if (ends_) {
        for (const auto& other : waiting_) other->finish(Job::End::stale, {});
        return;
      }
      job = waiting_.front();
      waiting_.pop_front();
      running_.push_back(job);
    }
    run(job);
  }
}

}  // namespace qjulia::explore
