#include "options.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace qjulia::tools {
namespace {

std::string not_finite(const std::string& text) {
  double value = 0;
  if (!CLI::detail::lexical_cast(text, value)) return fmt::format("'{}' is not a number", text);
  if (!std::isfinite(value)) return fmt::format("'{}' is not a finite number", text);
  return {};
}

}  // namespace

void add_verbosity(CLI::App& command, Verbosity& verbosity) {
  auto* quiet = command.add_flag("-q,--quiet", verbosity.quiet,
                                 "Say nothing but results, warnings and errors");
  command
      .add_flag("-v,--verbose", verbosity.verbose, "Say more, such as where the device's time went")
      ->excludes(quiet);
  command.add_flag("--json", verbosity.json,
                   "Print the result as one JSON object on standard output; everything else goes "
                   "to standard error");
}

void add_device(CLI::App& command, std::string& device) {
  command
      .add_option("--device", device,
                  "Where to compute: gpu, cpu, P:D (platform and device number of 'qjulia "
                  "devices') or part of a name. Default: $QJULIA_DEVICE, else the first GPU, else "
                  "the first device there is")
      ->type_name("DEVICE");
}

void add_trace(CLI::App& command, std::string& file) {
  command
      .add_option("--trace", file,
                  "Write what ran when, stages of the host and kernels of the device, as a "
                  "trace-event JSON for ui.perfetto.dev or chrome://tracing")
      ->type_name("FILE");
}

CLI::Validator finite() { return {not_finite, ""}; }

CLI::Option* add_number(CLI::App& command, const std::string& name, double& value,
                        const std::string& description) {
  return command.add_option(name, value, description)->check(finite())->type_name("NUMBER");
}

std::array<int, 2> parse_size(const std::string& text) {
  std::array<int, 2> size{};
  const char* end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size[0]);
  const bool crossed = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  if (crossed) {
    const auto height = std::from_chars(width.ptr + 1, end, size[1]);
    if (height.ec == std::errc() && height.ptr == end && size[0] > 0 && size[1] > 0) return size;
  }
  throw CLI::ValidationError("--size", fmt::format("'{}' is not WIDTHxHEIGHT in pixels, such as "
                                                   "1280x960",
                                                   text));
}

}  // namespace qjulia::tools
