#include "commands/launched_ranks.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/kernel_cache.hpp"
#include "console/device_obstacles.hpp"
#include "console/failure.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/device/tuning_cache.hpp"

#ifdef QJULIA_MPI
#include <mpi.h>
#include <unistd.h>

#include <numeric>
#include <thread>
#endif

namespace qjulia::tools {
namespace {

/// Whether OpenMPI, MPICH or Slurm started this process: each sets one of these variables.
bool is_launched() {
  constexpr std::array kSigns = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMI_RANK", "PMIX_RANK"};
  return std::ranges::any_of(kSigns, [](const char* name) { return std::getenv(name) != nullptr; });
}

/// Whether it is a GPU that a better platform shows too.
bool is_shown_twice(const DeviceInfo& info) { return !info.same_as.empty(); }

#ifdef QJULIA_MPI

/// This rank among those of its machine, or where the launcher does not say, among all.
std::string launched_rank() {
  for (const char* name : {"OMPI_COMM_WORLD_LOCAL_RANK", "MPI_LOCALRANKID", "SLURM_LOCALID",
                           "PMI_RANK", "PMIX_RANK"}) {
    if (const char* rank = std::getenv(name)) return rank;
  }
  return "0";
}

/// Waits for a request: awake while the others are at most some milliseconds behind, as they are
/// between the evaluations of a fit; asleep, leaving the core to others, when they take longer.
void wait_for(MPI_Request& request) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kAwake{20};
  constexpr std::chrono::milliseconds kNap{5};
  const auto start = Clock::now();
  for (;;) {
    int done = 0;
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done != 0) return;
    if (Clock::now() - start < kAwake) {
      std::this_thread::yield();
    } else {
      std::this_thread::sleep_for(kNap);
    }
  }
}

/// Messages of a batch's rounds: to rank 0, and from it.
constexpr int kToFirst = 1, kFromFirst = 2;

/// A message that has arrived.
std::optional<std::string> received(int from, int tag) {
  int is_there = 0;
  MPI_Message message{};
  MPI_Status status{};
  MPI_Improbe(from, tag, MPI_COMM_WORLD, &is_there, &message, &status);
  if (is_there == 0) return std::nullopt;
  int count = 0;
  MPI_Get_count(&status, MPI_BYTE, &count);
  std::string bytes(static_cast<std::size_t>(count), '\0');
  MPI_Mrecv(bytes.data(), count, MPI_BYTE, &message, MPI_STATUS_IGNORE);
  return bytes;
}

/// The time for which this process has waited, but for that in which it was stopped.
class Wait {
 public:
  void nap() {
    constexpr std::chrono::milliseconds kNap{5}, kStopped{1000};
    std::this_thread::sleep_for(kNap);
    const auto now = Clock::now();
    waited_ += std::min<Clock::duration>(now - last_, kStopped);
    last_ = now;
  }
  bool is_longer_than(std::chrono::seconds time) const { return waited_ > time; }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
  Clock::duration waited_{};
};

std::string packed_table(const std::vector<std::optional<std::string>>& messages) {
  nlohmann::json table = nlohmann::json::array();
  for (const auto& bytes : messages) {
    table.push_back(bytes ? nlohmann::json::binary({bytes->begin(), bytes->end()})
                          : nlohmann::json());
  }
  const auto packed = nlohmann::json::to_cbor(table);
  return {packed.begin(), packed.end()};
}

std::vector<std::optional<std::string>> unpacked_table(const std::string& bytes) {
  std::vector<std::optional<std::string>> messages;
  for (const nlohmann::json& one : nlohmann::json::from_cbor(bytes)) {
    if (one.is_null()) {
      messages.emplace_back();
    } else {
      messages.emplace_back(std::string(one.get_binary().begin(), one.get_binary().end()));
    }
  }
  return messages;
}

#endif

}  // namespace

int together(Ranks& ranks, const std::function<int()>& work) {
  int code = kDone;
  std::exception_ptr failure;
  try {
    code = work();
  } catch (const std::exception& error) {
    code = exit_code_of(error);
    failure = std::current_exception();
  }
  const auto all = ranks.all_gather({static_cast<double>(code), failure ? 1.0 : 0.0});
  const auto first =
      std::ranges::find_if(all, [](const auto& rank) { return !rank.empty() && rank[1] != 0; });
  if (failure && first - all.begin() == ranks.rank()) {
    try {
      std::rethrow_exception(failure);
    } catch (const std::exception& error) {
      say(error);
    }
  }
  for (const Ranks::Numbers& rank : all) {
    if (!rank.empty()) code = std::max(code, static_cast<int>(rank[0]));
  }
  return code;
}

struct LaunchedRanks::Sending {
  std::string bytes;
#ifdef QJULIA_MPI
  MPI_Request request{};
#endif
};

LaunchedRanks::LaunchedRanks() {
  if (!is_launched()) return;
#ifdef QJULIA_MPI
  int is_of_outer_command = 0;
  MPI_Initialized(&is_of_outer_command);
  if (is_of_outer_command != 0) return;
  // Before message passing starts, since that may look for OpenCL devices too.
  const auto own = base::kernel_cache().folder / fmt::format("rank-{}", launched_rank());
  std::error_code ignored;  // PoCL says what is wrong with it
  std::filesystem::create_directories(own, ignored);
  ::setenv("POCL_CACHE_DIR", own.c_str(), 1);
  int provided = 0;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided);
  has_joined_ = true;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
  MPI_Comm machine{};
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank_, MPI_INFO_NULL, &machine);
  MPI_Comm_rank(machine, &local_rank_);
  MPI_Comm_size(machine, &local_size_);
  MPI_Comm_free(&machine);
#else
  throw Error(
      "this program was started by mpirun and was built without MPI; install libopenmpi-dev and "
      "build it again, or start it without mpirun");
#endif
}

LaunchedRanks::~LaunchedRanks() {
#ifdef QJULIA_MPI
  if (has_joined_) MPI_Finalize();
#endif
}

std::vector<Ranks::Numbers> LaunchedRanks::all_gather(const Numbers& mine) {
  if (!has_joined_) return {mine};
  std::vector<Numbers> by_rank;
#ifdef QJULIA_MPI
  if (is_cut_off_) {
    by_rank.resize(static_cast<std::size_t>(size_));
    by_rank[static_cast<std::size_t>(rank_)] = mine;
    return by_rank;
  }
  if (!lost_.empty()) {
    const std::string bytes(reinterpret_cast<const char*>(mine.data()),
                            mine.size() * sizeof(double));
    for (const auto& said : exchange(bytes)) {
      Numbers& numbers = by_rank.emplace_back(said ? said->size() / sizeof(double) : 0);
      if (said) std::memcpy(numbers.data(), said->data(), numbers.size() * sizeof(double));
    }
    return by_rank;
  }
  constexpr std::size_t kMost = std::numeric_limits<int>::max();  // MPI counts in int
  const auto check = [](std::size_t numbers) {
    if (numbers <= kMost) return;
    throw Error("the ranks have more than 2^31 numbers for one message; use fewer factors");
  };
  check(mine.size());
  const auto count = static_cast<int>(mine.size());
  std::vector<int> counts(static_cast<std::size_t>(size_));
  MPI_Request request{};
  MPI_Iallgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, MPI_COMM_WORLD, &request);
  wait_for(request);
  check(std::accumulate(counts.begin(), counts.end(), std::size_t{0}, [](std::size_t sum, int one) {
    return sum + static_cast<std::size_t>(one);
  }));
  std::vector<int> places(counts.size());
  std::exclusive_scan(counts.begin(), counts.end(), places.begin(), 0);
  Numbers all(static_cast<std::size_t>(places.back() + counts.back()));
  MPI_Iallgatherv(mine.data(), count, MPI_DOUBLE, all.data(), counts.data(), places.data(),
                  MPI_DOUBLE, MPI_COMM_WORLD, &request);
  wait_for(request);
  for (std::size_t r = 0; r < counts.size(); ++r) {
    const auto first = all.begin() + places[r];
    by_rank.emplace_back(first, first + counts[r]);
  }
#endif
  return by_rank;
}

#ifdef QJULIA_MPI

/// Does not wait for the receiver, who may never take it.
void LaunchedRanks::send(int to, int tag, std::string bytes) {
  std::erase_if(sent_, [](Sending& sending) {
    int is_done = 0;
    MPI_Test(&sending.request, &is_done, MPI_STATUS_IGNORE);
    return is_done != 0;
  });
  Sending& sending = sent_.emplace_back();
  sending.bytes = std::move(bytes);
  MPI_Isend(sending.bytes.data(), static_cast<int>(sending.bytes.size()), MPI_BYTE, to, tag,
            MPI_COMM_WORLD, &sending.request);
}

std::vector<std::optional<std::string>> LaunchedRanks::exchange_as_first(const std::string& mine) {
  std::vector<std::optional<std::string>> said(static_cast<std::size_t>(size_));
  said.front() = mine;
  std::set<int> late;  // lost ranks that speak again
  Wait wait;
  for (;;) {
    bool is_any_missing = false;
    for (int rank = 1; rank < size_; ++rank) {
      auto& message = said[static_cast<std::size_t>(rank)];
      if (lost_.contains(rank)) {
        if (received(rank, kToFirst)) late.insert(rank);
      } else if (!message) {
        message = received(rank, kToFirst);
        is_any_missing = is_any_missing || !message;
      }
    }
    if (!is_any_missing) break;
    if (wait.is_longer_than(patience_)) {
      for (int rank = 1; rank < size_; ++rank) {
        if (!said[static_cast<std::size_t>(rank)]) lost_.insert(rank);
      }
      break;
    }
    wait.nap();
  }
  const std::string table = packed_table(said);
  for (int rank = 1; rank < size_; ++rank) {
    if (!lost_.contains(rank) || late.contains(rank)) send(rank, kFromFirst, table);
  }
  return said;
}

std::vector<std::optional<std::string>> LaunchedRanks::exchange(const std::string& mine) {
  if (!has_joined_) return {mine};
  if (rank_ == 0) return exchange_as_first(mine);
  send(0, kToFirst, mine);
  std::optional<std::string> table;
  Wait wait;
  while (!(table = received(0, kFromFirst))) {
    if (wait.is_longer_than(2 * patience_)) {
      is_cut_off_ = true;
      lost_.insert(0);
      throw Error(fmt::format("rank 0 has not answered for {} s; run again with --resume",
                              2 * patience_.count()));
    }
    wait.nap();
  }
  auto said = unpacked_table(*table);
  for (std::size_t rank = 0; rank < said.size(); ++rank) {
    if (!said[rank]) lost_.insert(static_cast<int>(rank));
  }
  if (lost_.contains(rank_)) {
    is_cut_off_ = true;
    throw Error(fmt::format("rank {} had not answered for {} s, and others do its entries", rank_,
                            patience_.count()));
  }
  return said;
}

void LaunchedRanks::leave(int code) {
  if (lost_.empty()) return;
  std::fflush(nullptr);
  if (rank_ == 0 || lost_.contains(0)) MPI_Abort(MPI_COMM_WORLD, code);
  for (;;) ::pause();
}

#else

std::vector<std::optional<std::string>> LaunchedRanks::exchange(const std::string& mine) {
  return {mine};
}
void LaunchedRanks::leave(int /*code*/) {}

#endif

std::vector<DeviceInfo> devices_of(const LaunchedRanks& ranks, const DeviceChoice& wanted) {
  expect_room_for_drivers();
  const bool all = wanted.name == "all";
  const DeviceInfo first = Device::choose({all ? "" : wanted.name, wanted.layout}).info();
  std::vector<DeviceInfo> shared{first};
  const bool by_kind = wanted.name.empty() || wanted.name == "gpu" || wanted.name == "cpu";
  if (all) {
    shared = list_devices();
    std::erase_if(shared, is_shown_twice);
  } else if (by_kind && ranks.local_size() > 1 && std::getenv("QJULIA_DEVICE") == nullptr) {
    shared = list_devices();
    std::erase_if(shared, [&](const DeviceInfo& info) {
      return info.kind != first.kind || is_shown_twice(info);
    });
    std::ranges::sort(shared, {}, &DeviceInfo::rank);
    // Each platform shows the same CPU.
    if (first.kind == DeviceKind::cpu) shared = {first};
  }
  const auto rank = static_cast<std::size_t>(ranks.local_rank());
  const auto size = static_cast<std::size_t>(ranks.local_size());
  if (size > shared.size()) return {shared[rank % shared.size()]};
  std::vector<DeviceInfo> mine;
  for (std::size_t i = rank; i < shared.size(); i += size) mine.push_back(shared[i]);
  return mine;
}

TrustedDevice own_device(const LaunchedRanks& ranks, const TrustedDevice& wanted) {
  if (ranks.size() == 1) return wanted;
  const DeviceInfo info = devices_of(ranks, wanted).front();
  return {{fmt::format("{}:{}", info.platform, info.index), wanted.layout}, wanted.is_trusted};
}

Device open_rank_device(const LaunchedRanks& ranks, const TrustedDevice& wanted, Session& session) {
  const TrustedDevice own = own_device(ranks, wanted);
  if (ranks.rank() == 0) return session.open_device(own);
  auto [device, warning] = with_cached_tuning(Device::choose(own));
  if (!warning.empty()) session.console.warn(warning);
  session.expect_right_results(device, own);
  return device;
}

}  // namespace qjulia::tools
