/// qjulia doctor compare: what changed from one report to another.

#include "commands/doctor_commands.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"

namespace qjulia::tools {
namespace {

struct CompareReportsArguments {
  std::string before, after;
};

int run_compare_reports(const CompareReportsArguments& arguments, Session& session) {
  session.check_outputs({{arguments.before, arguments.after}, {}});
  ReportComparison found =
      compare_reports(read_report(arguments.before, "A"), read_report(arguments.after, "B"));
  found.json["program"] = program_name();
  session.console.result(found.text, found.json);
  return found.is_worse ? kFailed : kDone;
}

void describe_compare_reports(Command command, CompareReportsArguments& a) {
  command.input("A", a.before, "A --json report, of another driver or build perhaps")
      .offers_files({".json"});
  command.input("B", a.after, "A later one").offers_files({".json"});
}

}  // namespace

void add_doctor_compare(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"doctor compare", "Say what changed between two reports, without a device",
               R"(Examples:
  qjulia doctor --json > report.json
  qjulia doctor compare report.json newer.json
Exit code 1 when a program has passed in A and not in B.)",
               /*can_trace=*/false},
              describe_compare_reports, run_compare_reports);
}

}  // namespace qjulia::tools
