#pragma once
/// Data that travels in a page.

#include <optional>
#include <string_view>

namespace qjulia::base {

/// The text of the page's first script element with this id; none where there is no such element.
/// The page may have been written anew by an editor or a browser: names are in any case, attributes
/// in any order and quotes. What only looks like an element, in a comment, an attribute or the text
/// of another script or style, is passed over.
std::optional<std::string_view> script_in(std::string_view page, std::string_view id);

}  // namespace qjulia::base
