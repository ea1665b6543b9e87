#pragma once
/// The text of a map file within pictures and scenes.

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

namespace qjulia::map {

/// The largest text of a map.
constexpr std::size_t kLargestMapText = std::size_t{64} << 20U;  // bytes

/// The text, deflated, after its length and that of what it was deflated to: 4 bytes each, the
/// highest first.
std::string packed_text(std::string_view text);

/// Whether files of this name hold maps in a chunk: .png and .glb.
bool is_map_carrier(const std::filesystem::path& path);

/// What a picture or scene holds of a map, as `packed_text` made it; none where it holds none.
/// @throws InputError where it is neither, or cut off.
std::optional<std::string> packed_text_in(const std::filesystem::path& path,
                                          const std::stop_token& stop);

/// @param source the file's name, for messages. @throws InputError where the bytes are damaged, or
/// would be more than `kLargestMapText`.
std::string unpacked_text(std::string_view packed, const std::string& source);

}  // namespace qjulia::map
