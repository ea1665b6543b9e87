#include "fit_options.hpp"

#include "options.hpp"

namespace qjulia::tools {

void add_fit_options(CLI::App& command, FitArguments& a) {
  command
      .add_option("--factors", a.options.factors,
                  "Factors of the map, 8 to 20000: more follow the shape more closely, and cost "
                  "time in proportion")
      ->capture_default_str();
  add_number(command, "--detail", a.options.detail,
             "Thickness of the fractal shell as a fraction of the shape's box diagonal, 0.001 to "
             "0.1: 0.005 smooth, 0.01 first detail, 0.02 to 0.03 clearly fractal, 0.05 heavily "
             "grooved. 'surface' and 'render' can change it later")
      ->capture_default_str();
  command
      .add_option("--time-limit", a.time_limit,
                  "Seconds of the whole command; the map reached by then is saved. Default: none")
      ->type_name("SECONDS");
  command
      .add_option("--max-evaluations", a.options.max_evaluations,
                  "Most evaluations of energy and gradient; 0 is the schedule's own number")
      ->capture_default_str();
  command
      .add_option("--seed", a.options.seed,
                  "Seed of all random choices. The same seed, options and device give the same "
                  "factors bit for bit, unless a time limit ends the fit")
      ->check(CLI::NonNegativeNumber)
      ->type_name("INT")
      ->capture_default_str();
  command.add_option("--schedule", a.options.schedule, "Name of a built-in fit schedule")
      ->capture_default_str();
  command
      .add_option("--unknowns", a.unknowns,
                  "What the fit may change: exponents alone, or exponents and centres")
      ->check(CLI::IsMember({"all", "exponents"}))
      ->capture_default_str();
  command.add_option("--precision", a.precision, "Arithmetic on the device")
      ->check(CLI::IsMember({"single", "double"}))
      ->capture_default_str();
}

FitOptions checked_options(const FitArguments& arguments) {
  FitOptions options = arguments.options;
  options.unknowns = arguments.unknowns == "all" ? Unknowns::all : Unknowns::exponents;
  options.precision = arguments.precision == "double" ? Precision::dbl : Precision::single;
  if (arguments.time_limit) options.time_limit = *arguments.time_limit;
  options.validate();
  return options;
}

}  // namespace qjulia::tools
