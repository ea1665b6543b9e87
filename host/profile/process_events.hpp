#pragma once
/// Counts what the processor does for this process: perf_event_open for each of its threads.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace qjulia::profiling {

struct EventKind {
  const char* name;  ///< of kEventNames
  std::uint32_t type;
  std::uint64_t config;
  double unit;  ///< of a count
};

/// The calls to the system, which tests replace.
class EventCalls {
 public:
  /// A count, and the nanoseconds for which it was wanted and for which it was counted: processors
  /// take turns where they have fewer counters than are asked for.
  struct Value {
    std::uint64_t count = 0, wanted = 0, counted = 0;
  };

  virtual ~EventCalls() = default;
  /// The numbers of this process's threads.
  virtual std::vector<int> threads() = 0;
  /// Counts in a thread and in those that it starts. @return a file; negative: −errno.
  virtual int open(const EventKind& kind, int thread) = 0;
  virtual Value read(int file) = 0;
  virtual void close(int file) = 0;
  /// The kernel's perf_event_paranoid; none where it has none.
  virtual std::optional<int> paranoia() = 0;
};

/// The calls of this system.
std::unique_ptr<EventCalls> system_event_calls();

/// The events of all threads that this process has now and of those that they start.
class ProcessEvents {
 public:
  explicit ProcessEvents(std::unique_ptr<EventCalls> calls);
  ~ProcessEvents();
  ProcessEvents(const ProcessEvents&) = delete;
  ProcessEvents& operator=(const ProcessEvents&) = delete;

  using Reading = std::vector<EventCalls::Value>;
  Reading read();
  /// What happened between two readings, by the event's name. An event that was not counted in all
  /// of the time is scaled up, one that was not counted at all is left out.
  std::map<std::string, double> between(const Reading& before, const Reading& after) const;
  /// The events that are not counted and why, a sentence for each reason.
  const std::vector<std::string>& refused() const { return refused_; }
  bool is_empty() const { return counters_.empty(); }

 private:
  struct Counter {
    const EventKind* kind;
    int file;
  };
  std::unique_ptr<EventCalls> calls_;
  std::vector<Counter> counters_;
  std::vector<std::string> refused_;
};

}  // namespace qjulia::profiling
