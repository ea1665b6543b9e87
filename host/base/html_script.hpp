#pragma once
/// Data that travels in a page.

#include <optional>
#include <string_view>

namespace qjulia::base {

/// The text of the page's first script element with this id; nothing if there is no such element.
/// An editor or a browser may have saved the page again, so names may be in upper or lower case,
/// and attributes in any order and with any quotes. What only looks like an element, in a comment,
/// an attribute or the text of another script or style, is passed over.
std::optional<std::string_view> script_in(std::string_view page, std::string_view id);

}  // namespace qjulia::base
