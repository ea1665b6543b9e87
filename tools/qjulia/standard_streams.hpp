#pragma once
/// Standard output and standard error. Printing never throws and never ends the process: what a
/// command has made is worth more than what it says about it.

#include <string>

namespace qjulia::tools {

/// Call it first. Files that are opened later do not get the number of a stream that was closed,
/// and a reader that goes away does not end the process.
void prepare_standard_streams();

/// To standard error, as it stands.
void print_error(const std::string& text);

/// A line to standard output. @return whether it was written; also where a pipe's reader, such as
/// `head`, has had enough.
bool print_result(const std::string& text);

}  // namespace qjulia::tools
