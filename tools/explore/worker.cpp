#include "explore/worker.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "qjulia/error.hpp"
#include "qjulia/progress.hpp"

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

Worker::Worker() : thread_([this] { run(); }) {}

Worker::~Worker() {
  end();
  thread_.join();
}

void Worker::end() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    if (running_) running_->cancel();
  }
  changed_.notify_all();
}

std::shared_ptr<Job> Worker::ask(const std::string& client, Job::Work work) {
  std::shared_ptr<Job> job(new Job(client, std::move(work)));
  std::vector<std::shared_ptr<Job>> stale;
  {
    const std::lock_guard lock(mutex_);
    const auto is_same = [&](const auto& other) { return other->client_ == client; };
    std::ranges::copy_if(waiting_, std::back_inserter(stale), is_same);
    std::erase_if(waiting_, is_same);
    if (running_ && is_same(running_)) running_->cancel();
    if (!ends_ && waiting_.size() < kMostJobs)
      waiting_.push_back(job);
    else
      return nullptr;
  }
  for (const auto& other : stale) other->finish(Job::End::stale, {});
  changed_.notify_all();
  return job;
}

void Worker::run() {
  for (;;) {
    std::unique_lock lock(mutex_);
    running_ = nullptr;
    changed_.wait(lock, [&] { return ends_ || !waiting_.empty(); });
    if (ends_) {
      for (const auto& job : waiting_) job->finish(Job::End::stale, {});
      return;
    }
    running_ = waiting_.front();
    waiting_.pop_front();
    const std::shared_ptr<Job> job = running_;
    lock.unlock();
    try {
      throw_if_stopped(job->stop_.get_token());
      job->finish(Job::End::done, job->work_(job->stop_.get_token()));
    } catch (const Interrupted&) {
      job->finish(Job::End::stale, {});
    } catch (const std::exception& error) {
      job->finish(Job::End::failed, error.what());
    }
  }
}

}  // namespace qjulia::explore
