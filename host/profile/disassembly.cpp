#include "profile/disassembly.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <nlohmann/json.hpp>
#include <vector>

extern char** environ;  // NOLINT(readability-redundant-declaration): not in every unistd.h

namespace qjulia::profiling {
namespace {

struct Instruction {
  std::uint64_t address = 0;
  std::string_view mnemonic;
  std::string_view operands;  ///< the destination last
};

std::optional<std::uint64_t> hexadecimal(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  return error == std::errc() && end != text.data() ? std::optional(value) : std::nullopt;
}

std::string_view without_spaces(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// Lines "  1770:\t62 c1 7d 48 …\tvmovupd -0x30(%r11),%zmm17"; the bytes may be missing.
std::vector<Instruction> instructions_of(std::string_view text) {
  std::vector<Instruction> all;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t colon = line.find(":\t");
    if (colon == std::string_view::npos) continue;
    const auto address = hexadecimal(without_spaces(line.substr(0, colon)));
    if (!address) continue;
    const std::string_view rest = without_spaces(line.substr(line.rfind('\t') + 1));
    const std::size_t space = std::min(rest.find_first_of(" \t"), rest.size());
    all.push_back({*address, rest.substr(0, space), without_spaces(rest.substr(space))});
  }
  return all;
}

/// From its first to its last instruction.
struct Loop {
  std::uint64_t first = 0, last = 0;
  bool holds(std::uint64_t address) const { return first <= address && address <= last; }
  std::uint64_t length() const { return last - first; }
};

/// Jumps back close loops. Those that begin at one place are one loop.
std::vector<Loop> loops_of(const std::vector<Instruction>& code) {
  std::map<std::uint64_t, std::uint64_t> last_by_first;
  for (const Instruction& i : code) {
    if (!i.mnemonic.starts_with('j')) continue;
    const auto target = hexadecimal(i.operands);
    if (!target || *target > i.address) continue;
    auto& last = last_by_first[*target];
    last = std::max(last, i.address);
  }
  std::vector<Loop> loops(last_by_first.size());
  std::ranges::transform(last_by_first, loops.begin(), [](const auto& ends) {
    return Loop{ends.first, ends.second};
  });
  return loops;
}

/// The shortest loop about an address; null where there is none.
const Loop* innermost(const std::vector<Loop>& loops, std::uint64_t address) {
  const Loop* best = nullptr;
  for (const Loop& loop : loops) {
    if (loop.holds(address) && (best == nullptr || loop.length() < best->length())) best = &loop;
  }
  return best;
}

bool is_any(std::string_view name, std::initializer_list<std::string_view> beginnings) {
  return std::ranges::any_of(beginnings, [&](auto b) { return name.starts_with(b); });
}

bool has_vector_register(std::string_view operands) {
  return operands.find("%xmm") != std::string_view::npos ||
         operands.find("%ymm") != std::string_view::npos ||
         operands.find("%zmm") != std::string_view::npos;
}

/// Bytes of its widest register.
int register_bytes(std::string_view operands) {
  if (operands.find("%zmm") != std::string_view::npos) return 64;
  return operands.find("%ymm") != std::string_view::npos ? 32 : 16;
}

/// Bytes of instructions that load less than a register and spread it over the register.
/// 0: it is none of them.
int spread_bytes(std::string_view name) {
  struct Spread {
    std::string_view ending;
    int bytes;
  };
  constexpr std::array kBroadcasts{Spread{"ss", 4},   Spread{"sd", 8},    Spread{"b", 1},
                                   Spread{"w", 2},    Spread{"d", 4},     Spread{"q", 8},
                                   Spread{"32x2", 8}, Spread{"32x4", 16}, Spread{"64x2", 16},
                                   Spread{"128", 16}, Spread{"32x8", 32}, Spread{"64x4", 32}};
  if (name.starts_with('p')) name.remove_prefix(1);
  if (!name.starts_with("broadcast")) return 0;
  const auto found = std::ranges::find_if(
      kBroadcasts, [&](const Spread& spread) { return name.ends_with(spread.ending); });
  return found == kBroadcasts.end() ? 0 : found->bytes;
}

/// Bytes that it loads or stores.
int memory_bytes(std::string_view name, std::string_view operands) {
  if (const int spread = spread_bytes(name); spread > 0) return spread;
  const bool is_double = name.ends_with("pd") || name.ends_with("sd");
  const bool is_one = name.ends_with("ss") || name.ends_with("sd") || name == "movd" ||
                      operands.find("{1to") != std::string_view::npos;
  if (name == "movq" || (is_one && is_double)) return 8;
  return is_one ? 4 : register_bytes(operands);
}

void count(const Instruction& i, InstructionMix& mix) {
  if (!has_vector_register(i.operands)) return;
  const std::string_view name = i.mnemonic.starts_with('v') ? i.mnemonic.substr(1) : i.mnemonic;
  // In AT&T syntax an address ends with ")", and the destination stands last.
  const std::size_t bracket = i.operands.rfind(')');
  const bool has_memory = bracket != std::string_view::npos;
  if (has_memory) {
    const bool is_store = i.operands.find(',', bracket) == std::string_view::npos;
    ++(is_store ? mix.stores : mix.loads);
    if (i.operands.find("(%rsp") != std::string_view::npos) {
      ++mix.spills;
    } else {
      mix.data_bytes += memory_bytes(name, i.operands);
    }
  }
  const bool is_from_integer = !has_memory && (name == "movd" || name == "movq");
  const bool is_shuffle =
      is_any(name, {"movmsk", "movddup", "movshdup", "movsldup", "movhl", "movlh"});
  const bool is_move = is_any(name, {"mov", "lddqu"}) && !is_from_integer && !is_shuffle;
  // A load that spreads or widens a scalar takes no other unit; moves between registers take none.
  if (is_move || (has_memory && is_any(name, {"broadcast", "pbroadcast"}))) return;
  int* const kind = is_any(name, {"fmadd", "fmsub", "fnmadd", "fnmsub"}) ? &mix.multiply_adds
                    : is_any(name, {"mulp", "muls"})                     ? &mix.multiplications
                    : is_any(name, {"divp", "divs", "sqrt"})             ? &mix.divisions
                                                                         : &mix.others;
  ++*kind;
  if (kind != &mix.others) mix.slot_bytes += register_bytes(i.operands);
}

}  // namespace

std::optional<InstructionMix> instruction_mix(std::string_view text, const AddressCounts& samples) {
  const std::vector<Instruction> code = instructions_of(text);
  const std::vector<Loop> loops = loops_of(code);
  std::map<const Loop*, std::size_t> by_loop;
  std::size_t all = 0;
  for (const auto& [address, times] : samples) {
    const auto at = std::ranges::lower_bound(code, address, {}, &Instruction::address);
    if (at == code.end() || at->address != address) continue;
    by_loop[innermost(loops, address)] += times;
    all += times;
  }
  if (all == 0) return std::nullopt;
  const auto& [hottest, times] =
      *std::ranges::max_element(by_loop, {}, [](const auto& entry) { return entry.second; });
  InstructionMix mix;
  for (const Instruction& i : code) {
    if (hottest == nullptr || innermost(loops, i.address) == hottest) count(i, mix);
  }
  mix.time_share = static_cast<double>(times) / static_cast<double>(all);
  mix.samples = all;
  return mix;
}

Disassembly disassembled(const std::filesystem::path& file) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return {{}, "no pipe can be opened for objdump"};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  std::array<std::string, 5> words{"objdump", "-dw", "-M", "att", file.string()};
  std::array<char*, words.size() + 1> list{};
  std::ranges::transform(words, list.begin(), [](std::string& word) { return word.data(); });
  pid_t child = 0;
  const int code = ::posix_spawnp(&child, "objdump", &actions, nullptr, list.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  Disassembly made;
  if (code == 0) {
    std::array<char, 65536> part{};
    for (;;) {
      const ssize_t got = ::read(ends[0], part.data(), part.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) break;
      made.text.append(part.data(), static_cast<std::size_t>(got));
    }
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) made.text.clear();
  }
  ::close(ends[0]);
  if (code != 0) {
    made.problem = "objdump cannot be run, which shows what kernels are made of; install binutils";
  } else if (made.text.empty()) {
    made.problem = fmt::format("objdump cannot read '{}'", file.string());
  }
  return made;
}

}  // namespace qjulia::profiling

namespace qjulia {

nlohmann::json to_json(const InstructionMix& mix) {
  return {{"multiply_adds", mix.multiply_adds},
          {"multiplications", mix.multiplications},
          {"divisions", mix.divisions},
          {"others", mix.others},
          {"loads", mix.loads},
          {"stores", mix.stores},
          {"spills", mix.spills},
          {"slot_bytes", mix.slot_bytes},
          {"data_bytes", mix.data_bytes},
          {"time_share", mix.time_share},
          {"samples", mix.samples},
          {"ceiling", mix.ceiling()}};
}

}  // namespace qjulia
