#pragma once
/// Parts of a page, escaped where text goes in.

#include <string>
#include <string_view>
#include <vector>

#include "qjulia/picture/picture.hpp"

namespace qjulia::html {

/// &, <, > and quotes as entities; bytes that are not UTF-8 or not XML's characters as U+FFFD.
std::string escaped(std::string_view text);

/// A row of headings, then rows of cells; all escaped.
std::string table(const std::vector<std::string>& headings,
                  const std::vector<std::vector<std::string>>& rows);

/// The picture itself in the page, and a line under it.
std::string figure(const Image& image, const std::string& caption);

/// A page with this body, styled for reading on screen and paper.
/// @param head what else stands in the page's head, such as more styles.
std::string page(const std::string& title, const std::string& body, const std::string& head = {});

}  // namespace qjulia::html
