#pragma once
/// Commented scripts of films to begin with.

#include <string>
#include <vector>

namespace qjulia::tools {

/// A commented script to begin with. @param name one of `film_template_names`
std::string film_template(const std::string& name);
std::vector<std::string> film_template_names();

}  // namespace qjulia::tools
