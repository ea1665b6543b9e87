/// qjulia batch merge: one table of shards.

#include <fmt/format.h>

#include "batch/shard.hpp"
#include "commands/batch_commands.hpp"
#include "commands/batch_display.hpp"

namespace qjulia::tools {
namespace {

struct MergeArguments {
  std::string folder;
};

int run_merge(const MergeArguments& arguments, Session& session) {
  const auto entries = batch::merge_shards(arguments.folder);
  batch::write_summary(arguments.folder, entries);
  std::string text = totals(entries);
  for (const batch::EntryStatus& entry : entries) {
    if (entry.state != batch::EntryState::done) text += "\n  " + describe(entry);
  }
  session.console.result(text, report_json(entries));
  return batch_exit_code(entries);
}

void describe_merge(Command command, MergeArguments& a) {
  command.input("FOLDER", a.folder, "The folder that the shards were given as --output")
      .offers_folders();
}

}  // namespace

void add_batch_merge(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"batch merge", "Put the shards of a batch together", R"(Example:
  qjulia batch run shapes.toml -o results --shard 1/2
  qjulia batch run shapes.toml -o results --shard 2/2     on another machine
  qjulia batch merge results
Copies the maps and what was made of them out of results/shard-I-of-N into results, and writes the
summary, the table and the page that the undivided batch would have. Shards may still be running;
merge again when they have ended. The exit code is 1 until every entry is done.)",
               /*can_trace=*/false},
              describe_merge, run_merge);
}

}  // namespace qjulia::tools
