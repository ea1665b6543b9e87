#pragma once
/// ZIP archives whose entries are stored as they are.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/deflate.hpp"

namespace qjulia::test {

/// @param entries names and contents.
inline std::string stored_zip(const std::vector<std::pair<std::string, std::string>>& entries) {
  const auto number = [](std::uint64_t value, int bytes) {
    std::string text;
    for (; bytes > 0; --bytes, value >>= 8U) text += static_cast<char>(value & 0xffU);
    return text;
  };
  std::string archive, directory;
  for (const auto& [name, content] : entries) {
    const std::string about = number(20, 2) + number(0, 2 + 2 + 4) +
                              number(base::crc_32(content), 4) + number(content.size(), 4) +
                              number(content.size(), 4) + number(name.size(), 2) + number(0, 2);
    directory += "PK\1\2" + number(20, 2) + about + number(0, 2 + 2 + 2) + number(0, 4) +
                 number(archive.size(), 4) + name;
    archive += "PK\3\4" + about + name + content;
  }
  const std::string end = "PK\5\6" + number(0, 4) + number(entries.size(), 2) +
                          number(entries.size(), 2) + number(directory.size(), 4) +
                          number(archive.size(), 4) + number(0, 2);
  return archive + directory + end;
}

}  // namespace qjulia::test
