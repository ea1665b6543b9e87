#include "help_format.hpp"

#include <sstream>

namespace qjulia::tools {

std::string HelpFormat::make_option_desc(const CLI::Option* option) const {
  constexpr std::size_t kColumns = 64;
  std::istringstream words(CLI::Formatter::make_option_desc(option));
  std::string text;
  std::string line;
  for (std::string word; words >> word;) {
    if (!line.empty() && line.size() + 1 + word.size() > kColumns) {
      text += line + '\n';
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  return text + line;
}

}  // namespace qjulia::tools
