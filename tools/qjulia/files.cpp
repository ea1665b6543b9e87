#include "files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <string>

#include "base/fnv_hash.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"

namespace qjulia::tools {

void check_outputs(const std::vector<std::filesystem::path>& inputs,
                   const std::vector<base::Output>& outputs) {
  base::check_distinct(inputs, outputs);
  for (const base::Output& output : outputs) base::check_writable(output);
}

bool is_mesh_file(const std::filesystem::path& path) {
  return has_type(path, FileContent::mesh, FileUse::read);
}

bool is_schedule_file(const std::string& schedule) { return extension_of(schedule) == ".toml"; }

bool is_original_file(const std::filesystem::path& path) {
  return has_type(path, FileContent::original_map, FileUse::read);
}

std::string file_hash(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  base::FnvHash hash;
  std::array<char, 65536> block;
  while (file.read(block.data(), block.size()) || file.gcount() > 0) {
    hash.add(std::string_view(block.data(), static_cast<std::size_t>(file.gcount())));
  }
  if (!file.eof()) throw InputError(fmt::format("cannot read '{}'", path.string()));
  return hash.text();
}

std::string text_hash(std::string_view text) {
  base::FnvHash hash;
  hash.add(text);
  return hash.text();
}

}  // namespace qjulia::tools
