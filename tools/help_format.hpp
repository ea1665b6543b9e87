#pragma once
#include <CLI/CLI.hpp>

namespace qjulia::tools {

/// CLI11's help with descriptions broken into lines.
class HelpFormat : public CLI::Formatter {
 public:
  std::string make_option_desc(const CLI::Option* option) const override;
};

}  // namespace qjulia::tools
