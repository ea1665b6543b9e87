/// qjulia profile: how fast the kernels run, against the device's own limits.

#include "qjulia/profile.hpp"

#include <fmt/format.h>

#include <fstream>

#include "commands.hpp"
#include "exit_code.hpp"
#include "options.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

struct Arguments {
  std::string device;
  std::string precision = "single";
  std::string baseline;
  double tolerance = 0.2;
  ProfileOptions options;
};

std::string optional_number(const std::optional<double>& value, double scale) {
  return value ? fmt::format("{:.2f}", *value * scale) : "-";
}

std::string table(const ProfileReport& report) {
  std::string text = fmt::format(
      "limits: {:.1f} G multiply-adds/s, copy {:.1f} GB/s, launch {:.1f} us\n"
      "kernel        n    samples  factors   median s      min s   Gpairs/s   of limit",
      1e-9 * report.limits.fma_per_second, 1e-9 * report.limits.bytes_per_second,
      1e6 * report.limits.launch_seconds);
  for (const KernelFigures& f : report.kernels) {
    text += fmt::format("\n{:12} {:2} {:10} {:8} {:10.5f} {:10.5f} {:>10} {:>10}", f.kernel,
                        f.iterations, f.samples, f.factors, f.median_seconds, f.min_seconds,
                        optional_number(f.pairs_per_second, 1e-9),
                        f.share_of_limit ? fmt::format("{:.0f} %", 100 * *f.share_of_limit) : "-");
  }
  return text;
}

nlohmann::json read_baseline(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw InputError(fmt::format("--baseline '{}' cannot be opened", path));
  auto json = nlohmann::json::parse(file, nullptr, false);
  if (json.is_discarded()) {
    throw InputError(fmt::format("--baseline '{}' is not JSON; make it with --json", path));
  }
  return json;
}

int run(Arguments arguments, Session& session) {
  ProfileOptions& options = arguments.options;
  options.precision = arguments.precision == "double" ? Precision::dbl : Precision::single;
  options.validate();
  if (!(arguments.tolerance >= 0)) throw InputError("--tolerance must not be negative");
  nlohmann::json baseline;
  if (!arguments.baseline.empty()) baseline = read_baseline(arguments.baseline);
  const Device device = session.open_device(arguments.device);
  const ProfileReport report = profile(device, options, session.watch());
  session.console.result(table(report), to_json(report));
  if (baseline.is_null()) return kDone;
  const auto slower = regressions(report, baseline, arguments.tolerance);
  for (const std::string& line : slower) session.console.warn("slower: " + line);
  return slower.empty() ? kDone : kFailed;
}

}  // namespace

void add_profile(CLI::App& program, ChosenCommand& chosen) {
  auto* command =
      program.add_subcommand("profile", "Measure the kernels against the device's limits");
  command->footer(
      "Examples:\n"
      "  qjulia profile\n"
      "  qjulia profile --json > before.json\n"
      "  qjulia profile --baseline before.json --tolerance 0.1    exit code 1 if slower\n"
      "A pair is one factor at one sample for one iterate. The share of the limit counts the\n"
      "multiplications and divisions that the kernel's source asks for against the multiply-adds\n"
      "that the device does when it does nothing else. Rays and distances end early by design:\n"
      "they have times only. Figures are of the device's own clock; quiet machines measure best.");
  auto arguments = std::make_shared<Arguments>();
  Arguments& a = *arguments;
  command->add_option("--samples", a.options.samples, "Sample points")->capture_default_str();
  command->add_option("--factors", a.options.factors, "Factors of the map")->capture_default_str();
  command->add_option("--repeats", a.options.repeats, "Timed runs of each kernel")
      ->capture_default_str();
  command
      ->add_option("--width", a.options.lane_width,
                   "Lanes of a work-item: 1, 8 or 16. Default: what suits the device")
      ->type_name("INT");
  command->add_option("--precision", a.precision, "Arithmetic on the device")
      ->check(CLI::IsMember({"single", "double"}))
      ->capture_default_str();
  command
      ->add_option("--baseline", a.baseline,
                   "An earlier --json report: exit code 1 if a kernel has become slower")
      ->type_name("FILE");
  add_number(*command, "--tolerance", a.tolerance,
             "What counts as slower: 0.2 is 20 % over the baseline's median")
      ->capture_default_str();
  add_device(*command, a.device);
  add_trace(*command, chosen.trace);
  add_verbosity(*command, chosen.verbosity);
  command->callback([arguments, &chosen] {
    chosen.run = [arguments](Session& session) { return run(*arguments, session); };
  });
}

}  // namespace qjulia::tools
