#include "files.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <limits>

#include "base/fnv_hash.hpp"
#include "base/input_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"

namespace qjulia::tools {

bool is_mesh_file(const std::filesystem::path& path) {
  return has_type(path, FileContent::mesh, FileUse::read);
}

void check_map_name(const std::filesystem::path& path) {
  const auto content = content_of(path);
  if (!content || *content == FileContent::map) return;
  throw InputError(fmt::format("--output: '{}' has the name of a {}; end it in .qjulia.json",
                               path.string(), to_string(*content)));
}

std::string file_hash(const std::filesystem::path& path) {
  constexpr std::uint64_t kBlock = std::uint64_t{1} << 20;
  base::InputFile file(path, "file", std::numeric_limits<std::uint64_t>::max());
  base::FnvHash hash;
  std::string block;
  do {
    block.clear();
    file.read(block, kBlock);
    hash.add(block);
  } while (!block.empty());
  return hash.text();
}

std::string text_hash(std::string_view text) {
  base::FnvHash hash;
  hash.add(text);
  return hash.text();
}

}  // namespace qjulia::tools
