#include "files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <thread>

#include "base/fnv_hash.hpp"
#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"
#include "qjulia/progress.hpp"

namespace qjulia::tools {

void check_outputs(const std::vector<std::filesystem::path>& inputs,
                   const std::vector<base::Output>& outputs) {
  base::check_distinct(inputs, outputs);
  for (const base::Output& output : outputs) base::check_writable(output);
}

bool is_named_pipe(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_fifo(path, ignored) &&
         !base::link_target(path).string().starts_with("/proc/");
}

std::shared_ptr<const int> opened_when_read(const std::filesystem::path& pipe,
                                            const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kBetweenTries{50};
  int file = -1;
  while ((file = ::open(pipe.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC)) < 0) {
    if (errno != ENXIO && errno != EINTR) {
      throw OutputError(fmt::format("cannot write '{}': {}", pipe.string(), std::strerror(errno)));
    }
    throw_if_stopped(stop);
    std::this_thread::sleep_for(kBetweenTries);
  }
  return {new int(file), [](const int* open) {
            ::close(*open);
            delete open;
          }};
}

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
