#pragma once
/// Files by patterns.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace qjulia::base {

/// What matches the pattern (glob(7)), which begins at `folder` where it is relative, in no order
/// that means anything.
std::vector<std::filesystem::path> files_matching(const std::filesystem::path& folder,
                                                  const std::string& pattern);

/// Whether a text comes before another where numbers in them go by their value: "walk9" before
/// "walk10".
bool comes_before(std::string_view one, std::string_view other);

}  // namespace qjulia::base
