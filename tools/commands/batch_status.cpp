/// qjulia batch status: how far a batch has come.

#include "commands/batch_commands.hpp"
#include "commands/batch_display.hpp"

namespace qjulia::tools {
namespace {

struct StatusArguments {
  std::string folder;
};

int run_status(const StatusArguments& arguments, Session& session) {
  const auto entries = batch::read_batch(arguments.folder, batch::is_locked(arguments.folder));
  std::string text;
  for (const batch::EntryStatus& entry : entries) text += describe(entry) + '\n';
  session.console.result(text + totals(entries), report_json(entries));
  return batch_exit_code(entries);
}

void describe_status(Command command, StatusArguments& a) {
  command.input("FOLDER", a.folder, "The folder that the batch writes to").offers_folders();
}

}  // namespace

void add_batch_status(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"batch status", "Report the progress of a batch", R"(Example:
  qjulia batch status results
The batch may be running, here or elsewhere. The exit code is 1 until every entry is done.)",
               /*can_trace=*/false},
              describe_status, run_status);
}

}  // namespace qjulia::tools
