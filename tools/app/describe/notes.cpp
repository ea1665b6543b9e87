#include "describe/notes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "base/deflate.hpp"
#include "base/file_types.hpp"
#include "base/input_file.hpp"
#include "base/text.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

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

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
    text.replace(at, from.size(), to);
  }
}

/// The beginning of a 3MF file's model: the first entry of that name (APPNOTE 6.3.9, 4.3.7).
std::string model_text(std::string_view bytes) {
  constexpr std::string_view kName = "3D/3dmodel.model";
  // Two bytes each at 26: the lengths of the name and of an extra field after it.
  constexpr std::size_t kHeader = 30, kLengths = 26, kEnough = std::size_t{64} << 10;
  const std::size_t name = bytes.find(kName);
  if (name == std::string_view::npos || name < kHeader) return {};
  const std::size_t extra = unsigned_at(bytes, name - kHeader + kLengths, false) >> 16U;
  std::string text;
  base::inflate_bare(bytes.substr(std::min(name + kName.size() + extra, bytes.size())),
                     [&](std::string_view part) {
                       text += part;
                       return text.size() < kEnough;
                     });
  return text;
}

/// The text of a note as it was before the format wrapped it.
std::string unwrapped(std::string text, const std::string& extension) {
  if (extension == ".ply") replace_all(text, "\ncomment ", "");
  if (extension == ".usda") {
    replace_all(text, "\\\\", "\\");
    replace_all(text, "\\\"", "\"");
  }
  if (extension == ".3mf") {
    text = model_text(text);
    constexpr std::array<std::pair<const char*, const char*>, 4> kEntities{
        {{"&quot;", "\""}, {"&lt;", "<"}, {"&gt;", ">"}, {"&amp;", "&"}}};
    for (const auto& [entity, character] : kEntities) replace_all(text, entity, character);
  }
  return text;
}

/// The JSON object that the text begins with; empty where it does not end. What follows may be of
/// any kind.
std::string_view first_object(std::string_view text) {
  bool is_quoted = false;
  int depth = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_quoted && c == '\\') {
      ++i;
    } else if (c == '"') {
      is_quoted = !is_quoted;
    } else if (!is_quoted && c == '{') {
      ++depth;
    } else if (!is_quoted && c == '}' && --depth == 0) {
      return text.substr(0, i + 1);
    }
  }
  return {};
}

/// A note that stands somewhere in the text.
nlohmann::json text_note(std::string_view text) {
  const std::size_t begin = text.find("{\"job\":");
  if (begin == std::string_view::npos) return {};
  return {{"made_with", parsed(first_object(text.substr(begin)))}};
}

}  // namespace

nlohmann::json embedded_note(const std::filesystem::path& path, const std::stop_token& stop) {
  // Notes stand before pixels, vertices and values.
  constexpr std::uint64_t kLongestBeginning = std::uint64_t{1} << 20;
  base::InputFile file(path, "file", std::numeric_limits<std::uint64_t>::max(), stop);
  std::string bytes;
  file.read(bytes, kLongestBeginning);
  nlohmann::json json;
  try {
    if (bytes.starts_with("\x89PNG\r\n")) {
      json = picture_note(bytes);
    } else if (bytes.starts_with("glTF")) {
      json = scene_note(bytes);
    } else if (base::can_hold_note(path)) {
      json = text_note(unwrapped(std::move(bytes), base::extension_of(path)));
    }
  } catch (const nlohmann::json::exception&) {
    // Another program's.
  }
  if (!json.contains("made_with") || json["made_with"].is_null()) {
    throw InputError(
        fmt::format("'{}' does not say how it was made", base::to_utf8(path.string())));
  }
  return json;
}

}  // namespace qjulia::tools
