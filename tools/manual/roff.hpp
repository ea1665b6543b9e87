#pragma once
/// Text in roff, the language of manual pages.

#include <string>
#include <string_view>

namespace qjulia::manual {

/// One word or line, with every character as it stands: no hyphens for minus signs, no curly
/// quotes.
std::string roff(std::string_view text);

/// A paragraph's text in lines of at most 78 columns.
std::string roff_paragraph(std::string_view text);

/// Lines as they stand, indented.
std::string roff_block(std::string_view lines);

std::string bold(std::string_view text);
std::string italic(std::string_view text);

}  // namespace qjulia::manual
