#pragma once
/// What ran when: stages of host work and kernels on the device, as a file for trace viewers.

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace qjulia {

/// Records where time goes. Hand it to `Device::record` for kernels and to `ProgressMonitor` for
/// stages; what has none of it pays nothing. Several threads may add; reading is for when they are
/// done.
class Trace {
 public:
  using Clock = std::chrono::steady_clock;
  /// A device has further queues where several threads use it (`Device::sibling`).
  enum class Row : std::uint8_t { host, device, second_queue, third_queue };
  /// The clock that an event's length was taken from. Kernels have the wall's where the device's
  /// events carry no times.
  enum class Timer : std::uint8_t { wall, device };

  struct Event {
    std::string_view name;  ///< as long as the trace lives
    Row row;
    Timer timer;
    std::int64_t start;   ///< nanoseconds since the trace began
    std::int64_t length;  ///< nanoseconds
  };

  /// The call that put a kernel in the queue, and the kernel's work.
  struct Call {
    Clock::time_point before{}, after{};
    double slots = 0;      ///< multiply-adds, multiplications and divisions; 0: not known
    double bytes = 0;      ///< read and written at least; 0: not known
    bool at_most = false;  ///< orbits may end before all of it is done
    std::array<std::size_t, 3> global{1, 1, 1}, local{1, 1, 1};  ///< work-items
  };

  explicit Trace(Clock::time_point begin = Clock::now()) : begin_(begin) {}
  Trace(const Trace&) = delete;
  Trace& operator=(const Trace&) = delete;

  void add(std::string_view name, Row row, Timer timer, Clock::time_point start,
           std::chrono::nanoseconds length);

  /// A kernel, with the call that launched it.
  void add_launch(std::string_view kernel, Row row, Timer timer, Clock::time_point start,
                  std::chrono::nanoseconds length, const Call& call);
  /// What a queue's buffers take from now on. @param row the queue's.
  void add_memory(Row row, Clock::time_point at, std::size_t bytes);

  /// Stages end before they are added: inner ones come first.
  const std::vector<Event>& events() const { return events_; }

  /// Writes the trace-event format's JSON, which Perfetto and Chrome's about:tracing open, by time
  /// in microseconds: complete events ("X") of stages on one row, and of each queue's calls and
  /// kernels on two others; `args.clock` says whose clock it was. A flow ("s", "f") leads from each
  /// call to its kernel, and counters ("C") show the launches in each queue and its buffers' bytes.
  /// @param device_name names the kernels' rows.
  /// @param figures further numbers about the whole run, written by name under `otherData`.
  /// @throws OutputError when it cannot be written; `path` then is as it was.
  void write(const std::filesystem::path& path, const std::string& device_name,
             const std::map<std::string, double>& figures = {}) const;

 private:
  struct Launch {
    std::size_t event;  ///< in `events_`
    Call call;
  };
  struct MemoryUse {
    Row row;
    std::int64_t at;  ///< nanoseconds since the trace began
    std::size_t bytes;
  };
  struct Lines;
  std::int64_t since_begin(Clock::time_point at) const;
  void add_locked(std::string_view name, Row row, Timer timer, Clock::time_point start,
                  std::chrono::nanoseconds length);

  Clock::time_point begin_;
  std::mutex adding_;
  std::set<std::string, std::less<>> names_;
  std::vector<Event> events_;
  std::vector<Launch> launches_;
  std::vector<MemoryUse> memory_;
};

/// A stage of host work, from construction to destruction. Without a trace it does nothing.
class TraceStage {
 public:
  TraceStage(const std::shared_ptr<Trace>& trace, std::string_view name);
  ~TraceStage();
  TraceStage(const TraceStage&) = delete;
  TraceStage& operator=(const TraceStage&) = delete;

 private:
  Trace* trace_;
  std::string name_;
  Trace::Clock::time_point start_;
};

}  // namespace qjulia
