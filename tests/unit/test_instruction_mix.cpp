/// What machine code is made of, and what that says of a kernel's limit.

#include <catch2/catch_all.hpp>
#include <cstdlib>
#include <filesystem>

#include "profile/disassembly.hpp"
#include "profile/explain.hpp"

using namespace qjulia;
using namespace qjulia::profiling;
using Catch::Matchers::ContainsSubstring;

namespace {

/// As objdump prints it: a loop from 20 to 50 about another from 30 to 40.
constexpr const char* kCode =
    "kernel.so:     file format elf64-x86-64\n"
    "\n"
    "0000000000000010 <kernel>:\n"
    "  10:\tvmovups (%rdi),%zmm0\n"
    "  18:\tvxorps %xmm1,%xmm1,%xmm1\n"
    "  20:\tvaddps %zmm0,%zmm1,%zmm2\n"
    "  30:\tvmovups (%rdx,%rax,4),%zmm3\n"
    "  31:\tvbroadcastss 0x4(%rcx),%zmm4\n"
    "  32:\tvfmadd231ps %zmm3,%zmm4,%zmm1\n"
    "  33:\tvfmadd213ps 0x40(%rsp),%zmm4,%zmm2\n"
    "  34:\tvmulps 0x8(%rsi){1to16},%zmm1,%zmm5\n"
    "  35:\tvminps %zmm5,%zmm1,%zmm5\n"
    "  36:\tvmovaps %zmm5,%zmm6\n"
    "  37:\tvmovups %zmm5,0x80(%rsp)\n"
    "  38:\tvmovups %ymm5,(%r8){%k1}\n"
    "  39:\tvdivps %xmm5,%xmm1,%xmm5\n"
    "  3a:\tadd    $0x40,%rax\n"
    "  40:\tjne    30 <kernel+0x20>\n"
    "  50:\tjne    20 <kernel+0x10>\n"
    "  58:\tvmulss %xmm0,%xmm0,%xmm0\n"
    "  5c:\tret\n";

InstructionMix mix_of(const AddressCounts& samples) {
  const auto mix = instruction_mix(kCode, samples);
  REQUIRE(mix);
  return *mix;
}

/// Two loads a multiply-add of single precision: 8 bytes for each.
Roofs roofs() {
  Roofs made;
  made.fma_per_second = made.fma_per_cpu_second = 1e11;
  made.bytes_per_second = made.bytes_per_cpu_second = 1e10;
  made.caches = {{1, 8e11, 8e11}, {2, 4e11, 4e11}, {3, 5e10, 5e10}};
  return made;
}

}  // namespace

TEST_CASE("the innermost loop with most samples is counted") {
  const InstructionMix mix = mix_of({{0x18, 5}, {0x20, 15}, {0x32, 50}, {0x39, 30}, {0x99, 77}});
  CHECK(mix.samples == 100);
  CHECK(mix.time_share == 0.8);
  CHECK(mix.multiply_adds == 2);
  CHECK(mix.multiplications == 1);
  CHECK(mix.divisions == 1);
  CHECK(mix.others == 1);
  CHECK(mix.loads == 4);
  CHECK(mix.stores == 2);
  CHECK(mix.spills == 2);
  CHECK(mix.slot_bytes == 3 * 64 + 16);
  CHECK(mix.data_bytes == 64 + 4 + 4 + 32);
  CHECK(mix.ceiling() == 0.8);
}

TEST_CASE("an outer loop is counted without the inner one, and a kernel without loops whole") {
  const InstructionMix outer = mix_of({{0x20, 9}, {0x32, 1}});
  CHECK(outer.others == 1);
  CHECK(outer.operations() == 1);
  CHECK(outer.time_share == 0.9);
  const InstructionMix all = mix_of({{0x58, 3}});
  CHECK(all.multiply_adds == 2);
  CHECK(all.multiplications == 2);
  CHECK(all.others == 3);
  CHECK_FALSE(instruction_mix(kCode, {{0x99, 1}}));
  CHECK_FALSE(instruction_mix("", {{0x10, 1}}));
}

TEST_CASE("what is spread over a register counts as the bytes that are loaded") {
  const auto bytes = [](const std::string& instruction) {
    const auto mix = instruction_mix("  10:\t" + instruction + "\n", {{0x10, 1}});
    REQUIRE(mix);
    return mix->data_bytes;
  };
  CHECK(bytes("vbroadcastss (%rax),%zmm1") == 4);
  CHECK(bytes("vbroadcastsd (%rax),%zmm1") == 8);
  CHECK(bytes("vpbroadcastd 0x4(%rax,%rcx,4),%zmm1") == 4);
  CHECK(bytes("vpbroadcastq (%rax),%ymm1") == 8);
  CHECK(bytes("vbroadcastf32x4 0x10(%rax),%zmm1") == 16);
  CHECK(bytes("vbroadcasti64x4 (%rax),%zmm1") == 32);
  CHECK(bytes("vbroadcastf128 (%rax),%ymm1") == 16);
  CHECK(bytes("vmulpd (%rax){1to8},%zmm1,%zmm2") == 8);
  CHECK(bytes("vmovups (%rax),%zmm1") == 64);
}

TEST_CASE("a file that objdump cannot read says so, and so does a missing objdump") {
  CHECK_THAT(disassembled("/no/such/file.so").problem,
             ContainsSubstring("objdump cannot read '/no/such/file.so'"));
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", "/no/such/folder", 1);
  const Disassembly without = disassembled("/no/such/file.so");
  ::setenv("PATH", path.c_str(), 1);
  CHECK(without.text.empty());
  CHECK_THAT(without.problem, ContainsSubstring("install binutils"));
}

TEST_CASE("what limits a kernel is named with its ceiling") {
  InstructionMix mix;
  mix.multiply_adds = 13;
  mix.others = 10;
  mix.loads = 5;
  mix.slot_bytes = 13 * 64;
  mix.data_bytes = 5 * 64;
  mix.time_share = 0.97;
  KernelWork work;
  work.slots = 1e9;
  const Spent spent{0.02, 0.02};
  const auto said = [&](double share, const InstructionMix* code) {
    const JudgedShare judged{share, share, share, "judged", "fma"};
    return limited_by(work, spent, judged, {roofs(), code, 5});
  };
  CHECK(said(0.55, &mix) ==
        "vector operations: a pass of its main loop (97 % of its time) has 13 multiply-adds and "
        "10 other vector operations (sums, comparisons, shuffles, conversions), which do not count "
        "as slots, beside 5 loads and 0 stores, so the ceiling is 57 %; 55 % is reached, 97 % of "
        "the ceiling");
  // 208 multiply-adds take 2.08 ns; 320 bytes take 0.8 ns of L2, 6.4 of L3 and 32 of memory.
  // 1 / .40 = p / .325 + (1 - p): p = .72
  CHECK_THAT(said(0.40, &mix),
             ContainsSubstring("waiting, for data or for its own earlier results") &&
                 ContainsSubstring("its data would allow 100 % if all came from L2, 32 % if all "
                                   "came from L3, 6 % if all came from memory. If data is the "
                                   "cause, 72 % of it comes from L3 and the rest from L2"));
  // 1 / .30 = p / .065 + (1 - p) / .325: p = .021
  CHECK_THAT(said(0.30, &mix),
             ContainsSubstring("2 % of it comes from memory and the rest from L3"));
  CHECK_THAT(
      said(0.05, &mix),
      ContainsSubstring("waiting, for its own earlier results or units") &&
          ContainsSubstring("data is not the cause, since even memory would give it faster"));
  CHECK_THAT(said(0.9, &mix), ContainsSubstring("more than these operations"));
  mix.loads = 50;  // 2 loads a multiply-add: 13 take as long as 26 loads
  CHECK(load_ceiling(mix, roofs(), false) == Catch::Approx(0.52));
  CHECK_THAT(said(0.5, &mix),
             ContainsSubstring("loads and stores: a pass") &&
                 ContainsSubstring("the ceiling is 52 % for its loads and stores"));
  CHECK(said(0.5, nullptr).empty());
}

TEST_CASE("a share that is not judged is shown with its cause, what to do, and what limits it") {
  InstructionMix mix;
  mix.multiply_adds = 16;
  mix.slot_bytes = 16 * 64;
  mix.data_bytes = 10 * 64;
  KernelWork work;
  work.slots = 1e9;
  const auto said = [&](Doubt doubt, std::size_t runs, const InstructionMix* code,
                        const std::optional<ProcessorUse>& use = {}) {
    const JudgedShare judged{{}, 0.2, 0.5, "not now", "fma", doubt};
    return limited_by(work, {0.02, 0.02}, judged, {roofs(), code, runs, use});
  };
  CHECK_THAT(said(Doubt::other_programs, 7, &mix, ProcessorUse{10, 4, 2.5}),
             ContainsSubstring("waiting") && ContainsSubstring("the ceiling is 100 %") &&
                 ContainsSubstring("20 to 50 % was seen in 7 runs") &&
                 ContainsSubstring("of it comes from L3") &&
                 ContainsSubstring("not judged now, because other programs had 2.5 of 4 "
                                   "processors: alone it reaches as much or more; close other "
                                   "programs and repeat it"));
  CHECK_THAT(said(Doubt::other_programs, 7, &mix, ProcessorUse{10, 4, 0, 0, 3, 1.5}),
             ContainsSubstring("stopped this program 3 times, for 1.5 s") &&
                 ContainsSubstring("raise the quota"));
  CHECK_THAT(said(Doubt::other_programs, 7, nullptr), ContainsSubstring("its threads waited"));
  CHECK(said(Doubt::spread, 7, nullptr) ==
        "20 to 50 % was seen in 7 runs; not judged, because its runs lie too far apart; repeat it "
        "with more runs");
  CHECK_THAT(said(Doubt::spread, 0, nullptr),
             ContainsSubstring("the limits before and after the command"));
  CHECK_THAT(said(Doubt::above_limit, 7, nullptr), ContainsSubstring("faster than the limit"));
}

TEST_CASE("a kernel is limited by the cache or the memory that its data comes from") {
  KernelWork work;
  work.bytes = 8e8;
  const Spent spent{0.02, 0.04};
  CHECK(limited_by(work, spent, {{}, {}, {}, "cached", "memory"}, {roofs()}) ==
        "caches: 40 GB/s of its data, which is 80 % of what L3 gives");
  CHECK_THAT(limited_by(work, spent, {0.9, 0.9, 0.9, "judged", "memory"}, {roofs()}),
             ContainsSubstring("memory: 90 % is reached of the copy's bandwidth"));
}

TEST_CASE("the sizes of a kernel's launches are said with what they have in common") {
  CHECK(size_text({}).empty());
  CHECK(size_text(LaunchSizes{{1, 992, "factors", 64}, {1, 992, "factors", 64}}) ==
        "992 factors x 64 points");
  CHECK(size_text(LaunchSizes{{1, 992, "factors", 64}, {1, 992, "factors", 128}}) ==
        "992 factors x 64 to 128 points");
  CHECK(size_text(LaunchSizes{{1, 672, "unknowns", 1024}, {8, 672, "unknowns", 1024}}) ==
        "672 unknowns x 1024 points to 8 x 672 unknowns x 1024 points");
  CHECK(size_text(LaunchSizes{{1, 64, "unknowns", 1024}, {8, 672, "unknowns", 1024}}) ==
        "64 unknowns x 1024 points to 8 x 672 unknowns x 1024 points");
}
