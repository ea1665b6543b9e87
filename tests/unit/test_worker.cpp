// The order in which clients of `qjulia explore` get their work done.

#include <catch2/catch_all.hpp>
#include <chrono>
#include <future>

#include "explore/worker.hpp"
#include "qjulia/base/error.hpp"

using namespace qjulia;
using explore::Job;
using explore::Worker;
using Length = explore::Job::Length;
using namespace std::chrono_literals;

namespace {

/// Work that ends when it is cancelled.
std::string until_stopped(Job& job) {
  while (!job.stop().stop_requested()) std::this_thread::sleep_for(1ms);
  throw Interrupted();
}

/// Returns these bytes at once.
Job::Work giving(const std::string& bytes) {
  return [bytes](Job&) { return bytes; };
}

}  // namespace

TEST_CASE("a client's next picture ends the one before") {
  Worker worker;
  const auto first = worker.ask("one", Length::picture, until_stopped);
  CHECK(first->wait(20ms) == Job::End::waits);
  const auto second = worker.ask("one", Length::picture, giving("2"));
  CHECK(first->wait(10s) == Job::End::stale);
  CHECK(second->wait(10s) == Job::End::done);
  CHECK(second->bytes() == "2");
}

TEST_CASE("what goes wrong is told, and the worker goes on") {
  Worker worker;
  const auto bad = worker.ask("one", Length::picture,
                              [](Job&) -> std::string { throw InputError("no such thing"); });
  CHECK(bad->wait(10s) == Job::End::failed);
  CHECK(bad->bytes() == "no such thing");
  const auto option = worker.ask("one", Length::picture, [](Job&) -> std::string {
    throw OptionError("samples", "give 1 to 8");
  });
  CHECK(option->wait(10s) == Job::End::failed);
  CHECK(option->bytes() == "samples: give 1 to 8");
  CHECK(worker.ask("one", Length::picture, giving("good"))->wait(10s) == Job::End::done);
}

TEST_CASE("pictures are drawn while long work is done, and do not end it") {
  Worker worker;
  std::promise<void> asked, drawn;
  const auto mesh = worker.ask("one", Length::long_job, [&](Job& job) {
    job.report({"", 0.5, -1, "half"});
    asked.get_future().wait();
    worker.draw_waiting();
    drawn.set_value();
    return std::string("mesh");
  });
  const auto own = worker.ask("one", Length::picture, giving("own"));
  const auto other = worker.ask("two", Length::picture, giving("other"));
  const auto later = worker.ask("two", Length::long_job, giving("later"));
  CHECK(own->wait(20ms) == Job::End::waits);
  asked.set_value();
  drawn.get_future().wait();
  CHECK(own->wait(0ms) == Job::End::done);
  CHECK(other->wait(0ms) == Job::End::done);
  CHECK(mesh->wait(10s) == Job::End::done);
  CHECK(mesh->progress() == "~0.500 half\n");
  CHECK(later->wait(10s) == Job::End::done);
}

TEST_CASE("a client's next long work ends the one before, in which a picture waits") {
  Worker worker;
  const auto first = worker.ask("one", Length::long_job, until_stopped);
  const auto picture = worker.ask("one", Length::picture, giving("picture"));
  const auto second = worker.ask("one", Length::long_job, giving("second"));
  CHECK(first->wait(10s) == Job::End::stale);
  CHECK(picture->wait(10s) == Job::End::done);
  CHECK(second->wait(10s) == Job::End::done);
}

TEST_CASE("no more work is taken than can wait, and none after the end") {
  Worker worker;
  const auto first = worker.ask("0", Length::picture, until_stopped);
  CHECK(first->wait(20ms) == Job::End::waits);
  std::vector<std::shared_ptr<Job>> waiting;
  for (std::size_t i = 0; i < Worker::kMostJobs; ++i) {
    waiting.push_back(worker.ask(std::to_string(i + 1), Length::picture, giving("")));
    CHECK(waiting.back() != nullptr);
  }
  CHECK(worker.ask("one more", Length::picture, giving("")) == nullptr);
  worker.end();
  CHECK(first->wait(10s) == Job::End::stale);
  for (const auto& job : waiting) CHECK(job->wait(10s) == Job::End::stale);
  CHECK(worker.ask("late", Length::picture, giving("")) == nullptr);
}
