#include "device/program_store.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/fnv_hash.hpp"
#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::device {
namespace {

constexpr const char* kProgramFormat = "qjulia-program";
constexpr const char* kProgramEnding = ".program";

std::string hash_of(const std::vector<std::string>& parts) {
  base::FnvHash hash;
  for (const std::string& part : parts) {
    hash.add(part.size());
    hash.add(part);
  }
  return hash.text();
}

std::string checksum_of(const StoredProgram& program) {
  return hash_of({hash_of(program.kernels), program.binary});
}

/// The first line of a file, from which the rest follows.
nlohmann::json head_of(const ProgramKey& key, const StoredProgram& program) {
  return {{"format", kProgramFormat},
          {"version", 1},
          {"owner", key.owner},
          {"options", key.options},
          {"source", hash_of({key.source})},
          {"kernels", program.kernels},
          {"bytes", program.binary.size()},
          {"checksum", checksum_of(program)}};
}

std::string line_of(const nlohmann::json& head) {
  return head.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace) + '\n';
}

}  // namespace

std::string ProgramKey::name() const { return hash_of({owner, options, source}); }

ProgramStore::ProgramStore(std::filesystem::path folder, std::uint64_t most_bytes)
    : folder_(std::move(folder)), most_bytes_(most_bytes) {}

std::filesystem::path ProgramStore::file(const ProgramKey& key) const {
  return folder_ / (key.name() + kProgramEnding);
}

std::optional<StoredProgram> ProgramStore::load(const ProgramKey& key) const {
  std::error_code failed;
  const auto path = file(key);
  if (!std::filesystem::exists(path, failed)) return std::nullopt;
  std::string bytes;
  try {
    base::InputFile(path, "compiled program", most_bytes_).read_all(bytes);
  } catch (const InputError&) {
    return std::nullopt;
  }
  const std::size_t end = bytes.find('\n');
  if (end == std::string::npos) return std::nullopt;
  const auto head = nlohmann::json::parse(bytes.substr(0, end), nullptr, false);
  if (!head.is_object() || !head.contains("kernels") || !head["kernels"].is_array()) {
    return std::nullopt;
  }
  StoredProgram program;
  for (const auto& name : head["kernels"]) {
    if (!name.is_string()) return std::nullopt;
    program.kernels.push_back(name);
  }
  program.binary = bytes.substr(end + 1);
  if (line_of(head_of(key, program)) != bytes.substr(0, end + 1)) return std::nullopt;
  // Its time is that of its last use.
  std::filesystem::last_write_time(path, std::filesystem::file_time_type::clock::now(), failed);
  return program;
}

void ProgramStore::save(const ProgramKey& key, const StoredProgram& program) const {
  std::error_code failed;
  std::filesystem::create_directories(folder_, failed);
  if (failed) return;  // the next process compiles it again
  try {
    base::OutputFile out(file(key));
    out.stream() << line_of(head_of(key, program)) << program.binary;
    out.commit();
    base::remove_all_leftovers(folder_);
    remove_oldest(file(key));
  } catch (const OutputError&) {
    // The next process compiles it again.
  }
}

/// @param kept stays, however large it is.
void ProgramStore::remove_oldest(const std::filesystem::path& kept) const {
  struct File {
    std::filesystem::file_time_type used;
    std::uint64_t bytes;
    std::filesystem::path path;
  };
  std::vector<File> files;
  std::uint64_t bytes = 0;
  // Other processes add and remove files meanwhile. Where listing fails, the files
  // found so far are used.
  std::error_code failed;
  for (std::filesystem::directory_iterator at(folder_, failed), end; !failed && at != end;
       at.increment(failed)) {
    const std::filesystem::path path = at->path();
    if (path.extension() != kProgramEnding) continue;
    std::error_code gone;
    const auto size = std::filesystem::file_size(path, gone);
    if (gone) continue;
    const auto used = std::filesystem::last_write_time(path, gone);
    if (gone) continue;
    bytes += size;
    if (path != kept) files.push_back({used, size, path});
  }
  std::ranges::sort(files, {}, &File::used);
  for (const File& oldest : files) {
    if (bytes <= most_bytes_) return;
    std::error_code gone;
    std::filesystem::remove(oldest.path, gone);
    bytes -= oldest.bytes;
  }
}

}  // namespace qjulia::device
