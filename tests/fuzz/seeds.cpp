// Hands each fuzzed reader its seeds: `fuzz_seeds FOLDER` takes every file of FOLDER/NAME, whole
// and cut in the middle. The program aborts where a reader breaks one of its rules.

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#define FUZZED(name) extern "C" int fuzz_##name(const std::uint8_t* data, std::size_t size);
#include "fuzzed.inc"
#undef FUZZED

namespace {

using Fuzzed = int (*)(const std::uint8_t* data, std::size_t size);

/// @return whether the folder has seeds
bool take_seeds(Fuzzed fuzzed, const std::filesystem::path& folder) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(file), {});
    const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
    std::printf("%s\n", entry.path().c_str());
    std::fflush(stdout);  // so that the last line names what ended the program
    fuzzed(data, bytes.size());
    fuzzed(data, bytes.size() / 2);
    ++count;
  }
  if (count == 0) std::fprintf(stderr, "%s has no seeds\n", folder.c_str());
  return count > 0;
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) return 2;
  const std::filesystem::path seeds = words[1];
  bool have_all = true;
#define FUZZED(name) have_all = take_seeds(fuzz_##name, seeds / #name) && have_all;
#include "fuzzed.inc"
#undef FUZZED
  return have_all ? 0 : 1;
}
