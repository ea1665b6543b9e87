#pragma once
/// What the note in a picture that `render` made says to pages.

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace qjulia::tools {

/// What follows '#' in the address of a page of `explore` that shows the picture's view: the
/// controls of the page that differ from their defaults. Empty where the note says nothing of it.
std::string page_state(const nlohmann::json& made);

}  // namespace qjulia::tools
