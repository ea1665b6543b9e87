#include "device/cache_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "base/fnv_hash.hpp"
#include "base/text.hpp"
#include "device/program_source.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::device {

std::filesystem::path cache_folder() {
  // A relative path is to be ignored: XDG Base Directory Specification 0.8.
  if (const char* cache = std::getenv("XDG_CACHE_HOME");
      cache != nullptr && std::filesystem::path(cache).is_absolute()) {
    return std::filesystem::path(cache) / "qjulia";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    return std::filesystem::path(home) / ".cache" / "qjulia";
  }
  throw Error("neither XDG_CACHE_HOME nor HOME says where tuned settings are kept; set one");
}

std::string kernels_hash() {
  base::FnvHash hash;
  for (const auto& [path, text] : embedded_kernels()) {
    hash.add(path);
    hash.add(text);
  }
  return hash.text();
}

std::string environment_word(const char* variable, std::initializer_list<const char*> words,
                             const char* meaning) {
  const char* wanted = std::getenv(variable);
  std::string word = base::lower_case(wanted == nullptr ? "" : wanted);
  if (word.empty()) return *words.begin();
  if (std::ranges::any_of(words, [&](const char* known) { return word == known; })) return word;
  throw InputError(fmt::format("{} is '{}'; give {}", variable, wanted, meaning));
}

}  // namespace qjulia::device
