#include "files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/fnv_hash.hpp"
#include "base/input_file.hpp"
#include "base/text.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"
#include "qjulia/map_file.hpp"

namespace qjulia::tools {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

std::uint32_t unsigned_at(std::string_view bytes, std::size_t at, bool big_endian) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto byte = static_cast<unsigned char>(bytes[at + (big_endian ? i : 3 - i)]);
    value = value << 8U | byte;
  }
  return value;
}

/// Nothing where it is nested deeper than a note of ours.
nlohmann::json parsed(std::string_view text) {
  return base::is_json_too_deep(text) ? nlohmann::json() : nlohmann::json::parse(text);
}

/// PNG specification, 5.3: length, type, data, CRC; the first chunk is IHDR.
nlohmann::json picture_note(std::string_view bytes) {
  using namespace std::string_view_literals;
  constexpr std::size_t kSignature = 8, kType = 4, kData = 8, kFrame = 12;
  constexpr std::string_view kKeyword = "qjulia\0"sv;
  nlohmann::json json;
  for (std::size_t chunk = kSignature; chunk + kFrame <= bytes.size();) {
    const std::size_t length = unsigned_at(bytes, chunk, true);
    const std::string_view type = bytes.substr(chunk + kType, 4);
    if (length > bytes.size() - chunk - kFrame || type == "IDAT") break;
    const std::string_view data = bytes.substr(chunk + kData, length);
    if (type == "IHDR" && length >= 8) {
      json["width"] = unsigned_at(data, 0, true);
      json["height"] = unsigned_at(data, 4, true);
    } else if (type == "tEXt" && data.starts_with(kKeyword)) {
      json["made_with"] = parsed(data.substr(kKeyword.size()));
    }
    chunk += kFrame + length;
  }
  return json;
}

/// glTF 2.0, 4.4: a header of 12 bytes, then length and type of the JSON chunk.
nlohmann::json scene_note(std::string_view bytes) {
  constexpr std::size_t kChunk = 12, kData = 20;
  if (bytes.size() < kData) return {};
  const nlohmann::json scene = parsed(bytes.substr(kData, unsigned_at(bytes, kChunk, false)));
  const nlohmann::json& primitive = scene.at("meshes").at(0).at("primitives").at(0);
  const auto count = [&](const nlohmann::json& accessor) {
    return scene.at("accessors").at(accessor.get<std::size_t>()).at("count").get<std::uint64_t>();
  };
  const std::string note = scene.at("asset").at("extras").at("made_with");
  return {{"vertices", count(primitive.at("attributes").at("POSITION"))},
          {"triangles", count(primitive.at("indices")) / 3},
          {"made_with", parsed(note)}};
}

}  // namespace

bool is_mesh_file(const std::filesystem::path& path) {
  if (!has_type(path, FileContent::mesh, FileUse::read)) return false;
  // What comes through a pipe cannot be looked at first.
  std::error_code ignored;
  return !std::filesystem::is_regular_file(path, ignored) || !holds_map(path);
}

void expect_map(const std::string& option, const std::filesystem::path& path) {
  if (!is_mesh_file(path)) return;
  throw InputError(fmt::format("{} needs a map, and '{}' is a mesh", option, path.string()));
}

std::string shell_word(const std::string& name) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./+,:@%=";
  std::string word = name.starts_with('-') ? "./" + name : name;
  if (word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::string name_of(const std::filesystem::path& path) {
  return base::to_utf8(path.filename().string());
}

void check_map_name(const std::filesystem::path& path) {
  const auto content = content_of(path);
  if (!content || *content == FileContent::map) return;
  throw InputError(fmt::format("--output: '{}' has the name of a {}; end it in .qjulia.json",
                               path.string(), to_string(*content)));
}

std::vector<std::string> readable(std::initializer_list<FileContent> contents) {
  std::vector<std::string> all;
  for (const FileContent content : contents) {
    for (std::string& extension : extensions(content, FileUse::read)) {
      if (std::ranges::find(all, extension) == all.end()) all.push_back(std::move(extension));
    }
  }
  return all;
}

std::string named_after(const std::string& input, const std::string& extension) {
  std::filesystem::path stem = std::filesystem::path(input).filename().stem();
  if (extension_of(stem) == ".qjulia") stem = stem.stem();
  return stem.string() + extension;
}

base::Output output_named(const std::string& option, const OutputName& name,
                          std::vector<std::string> extensions) {
  return {option, name.path, std::move(extensions), false, name.must_be_new};
}

nlohmann::json read_report(const std::string& path, const std::string& what) {
  constexpr std::uint64_t kLargestFile = std::uint64_t{16} << 20;
  const std::string text = base::read_text_file(path, "report", kLargestFile);
  auto json = base::is_json_too_deep(text) ? nlohmann::json(nlohmann::json::value_t::discarded)
                                           : nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) {
    throw InputError(fmt::format("{} '{}' is not JSON; make it with --json", what, path));
  }
  return json;
}

std::string file_hash(const std::filesystem::path& path) {
  constexpr std::uint64_t kBlock = std::uint64_t{1} << 20;
  base::InputFile file(path, "file", kNoLimit);
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

bool can_hold_note(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".png" || extension == ".glb";
}

nlohmann::json embedded_note(const std::filesystem::path& path, const std::stop_token& stop) {
  // Notes stand before pixels and vertices.
  constexpr std::uint64_t kLongestBeginning = std::uint64_t{1} << 20;
  base::InputFile file(path, "file", kNoLimit, stop);
  std::string bytes;
  file.read(bytes, kLongestBeginning);
  nlohmann::json json;
  try {
    if (bytes.starts_with("\x89PNG\r\n")) json = picture_note(bytes);
    if (bytes.starts_with("glTF")) json = scene_note(bytes);
  } catch (const nlohmann::json::exception&) {
    // Another program's.
  }
  if (!json.contains("made_with") || json["made_with"].is_null() ||
      !(json.contains("width") || json.contains("triangles"))) {
    throw InputError(fmt::format(
        "'{}' does not say how it was made; 'info' reads maps, meshes ({}), and the pictures "
        "that this program writes",
        base::to_utf8(path.string()), extension_list(FileContent::mesh, FileUse::read)));
  }
  return json;
}

}  // namespace qjulia::tools
