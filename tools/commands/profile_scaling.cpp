/// qjulia profile scaling: the cost of an evaluation against its size.

#include <vector>

#include "base/output_file.hpp"
#include "commands/profile_commands.hpp"
#include "commands/profile_tables.hpp"
#include "console/failure.hpp"
#include "qjulia/profile/scaling.hpp"

namespace qjulia::tools {
namespace {

struct ScalingArguments : MeasuredArguments {
  std::string csv;
};

int run_scaling(const ScalingArguments& arguments, Session& session) {
  std::vector<base::Output> outputs;
  if (!arguments.csv.empty()) outputs.push_back({"--csv", arguments.csv, {".csv"}});
  session.check_outputs({{}, outputs});
  const Device device = session.open_device(arguments.device);
  ScalingOptions options;
  options.precision = arguments.options.precision;
  const ScalingReport report = measure_scaling(device, options, session.monitor());
  if (!arguments.csv.empty()) base::write_file(arguments.csv, to_csv(report));
  session.console.result(profile_table(report), to_json(report));
  return kDone;
}

void describe_scaling(Command command, ScalingArguments& a) {
  command
      .file("--csv", a.csv, "FILE.csv", "Also write the figures as a table, a line for each size")
      .offers_files({".csv"});
  add_measured(command, a, {"precision"});
}

}  // namespace

void add_profile_scaling(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"profile scaling", "Measure how the cost of an evaluation grows with its size",
               R"(Examples:
  qjulia profile scaling
  qjulia profile scaling --csv sizes.csv
Measures the time and the memory of an energy with its gradient, for 25^3 to 193^3 sample points
and 83 to 1324 factors, and fits a power law to the times.)"},
              describe_scaling, run_scaling);
}

}  // namespace qjulia::tools
