/// qjulia profile report: profiles of several builds on one page.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/output_file.hpp"
#include "benchmark/profile_page.hpp"
#include "commands/profile_commands.hpp"
#include "describe/files.hpp"

namespace qjulia::tools {
namespace {

struct ReportArguments {
  std::vector<std::string> files;
  std::string page;
};

int run_report(const ReportArguments& arguments, Session& session) {
  session.check_outputs({{arguments.files.begin(), arguments.files.end()},
                         {{"--output", arguments.page, {".html"}}}});
  std::vector<benchmark::NamedProfile> profiles;
  for (const std::string& file : arguments.files) {
    profiles.push_back(
        {std::filesystem::path(file).filename().string(), read_report(file, "REPORT")});
  }
  const std::size_t count = profiles.size();
  base::write_file(arguments.page, benchmark::profile_page(std::move(profiles)));
  session.console.summary(
      fmt::format("{}: {} report{}", arguments.page, count, count == 1 ? "" : "s"),
      {{"page", arguments.page}, {"reports", count}});
  return kDone;
}

void describe_report(Command command, ReportArguments& a) {
  command
      .words(
          "REPORT", [&a](const std::string& file) { a.files.push_back(file); },
          "--json reports of 'qjulia profile measure', of several commits, flags or drivers; no "
          "files of --profile, whose kernels ran once")
      .required()
      .offers_files({".json"});
  command.output(a.page, "PAGE.html", "The page").offers_files({".html"});
}

}  // namespace

void add_profile_report(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"profile report", "Put profiles of several builds on one page", R"(Examples:
  qjulia profile measure --kernels '*' --json > after.json
  qjulia profile report before.json after.json -o profiles.html
The page holds all that it shows: the reports by date, what changed between each and the one
before (commit, build flags, driver, settings), what each kernel of the last reaches and what
limits it, the roofline with the caches, and the time of each kernel over the reports.)",
               /*can_trace=*/false},
              describe_report, run_report);
}

}  // namespace qjulia::tools
