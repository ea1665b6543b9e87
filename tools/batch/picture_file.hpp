#pragma once
/// Pictures read back for the contact sheet.

#include <filesystem>
#include <optional>

#include "qjulia/picture.hpp"

namespace qjulia::batch {

/// Nothing when there is no PNG of that name that can be read.
std::optional<Image> read_picture(const std::filesystem::path& path);

/// At most `width` pixels wide: whole pixels averaged in squares.
Image shrunk(const Image& image, int width);

}  // namespace qjulia::batch
