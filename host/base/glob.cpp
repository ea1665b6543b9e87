#include "base/glob.hpp"

#include <glob.h>

#include <algorithm>

namespace qjulia::base {
namespace {

/// A pattern that matches this text alone.
std::string escaped(const std::string& text) {
  std::string pattern;
  for (const char c : text) {
    if (std::string_view("*?[\\").find(c) != std::string_view::npos) pattern += '\\';
    pattern += c;
  }
  return pattern;
}

}  // namespace

std::vector<std::filesystem::path> files_matching(const std::filesystem::path& folder,
                                                  const std::string& pattern) {
  std::vector<std::filesystem::path> found;
  glob_t matches{};
  if (::glob((escaped(folder.string()) / std::filesystem::path(pattern)).c_str(), 0, nullptr,
             &matches) == 0) {
    for (std::size_t i = 0; i < matches.gl_pathc; ++i) found.emplace_back(matches.gl_pathv[i]);
  }
  ::globfree(&matches);
  return found;
}

bool comes_before(std::string_view one, std::string_view other) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  while (!one.empty() && !other.empty()) {
    if (!is_digit(one.front()) || !is_digit(other.front())) {
      if (one.front() != other.front()) return one.front() < other.front();
      one.remove_prefix(1);
      other.remove_prefix(1);
      continue;
    }
    const auto take_number = [&](std::string_view& text) {
      while (text.size() > 1 && text[0] == '0' && is_digit(text[1])) text.remove_prefix(1);
      const auto end = std::ranges::find_if_not(text, is_digit);
      const std::string_view digits(text.data(), static_cast<std::size_t>(end - text.begin()));
      text.remove_prefix(digits.size());
      return digits;
    };
    const std::string_view first = take_number(one), second = take_number(other);
    if (first.size() != second.size()) return first.size() < second.size();
    if (first != second) return first < second;
  }
  return one.size() < other.size();
}

}  // namespace qjulia::base
