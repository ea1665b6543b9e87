/// qjulia batch: many meshes in, many maps out.

#include "commands/batch_commands.hpp"
#include "commands/manifest_options.hpp"
#include "jobs/job_run.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

void check_job(batch::EntryJob& job, const std::filesystem::path& folder) {
  find_files(job.options, command_usage(job.command), folder);
  const Plan plan = JobRun(entry_job(job, "map.qjulia.json"), "file" + job.extension).plan();
  if (plan.outputs.size() > 1) {
    throw InputError("an entry has one file of each kind; leave out what makes more of them");
  }
}

}  // namespace

Job entry_job(const batch::EntryJob& job, const std::filesystem::path& map) {
  Job made{.command = job.command, .options = job.options};
  if (made.options.contains("map")) {
    throw InputError("map: a batch gives each entry its own map; leave it out");
  }
  made.options["map"] = map.string();
  return made;
}

void add_manifest(Command command, std::string& file) {
  command.input("MANIFEST", file, "What to fit: a TOML file, as in the example")
      .offers_files({".toml"});
}

batch::Manifest read_manifest(const std::string& file, bool may_miss_meshes,
                              const std::stop_token& stop) {
  const batch::ManifestChecks checks{
      [](const std::vector<batch::ManifestOption>& options) { fit_options(options); }, check_job};
  return batch::read_manifest(file, checks, may_miss_meshes, stop);
}

void add_batch(CommandLine& program, ChosenCommand& chosen) {
  program.add_group({"batch",
                     "Fit many meshes, resumable after any interruption",
                     R"(Examples:
  qjulia batch check shapes.toml
  qjulia batch run shapes.toml -o results
  qjulia batch status results)",
                     "",
                     {{"--status", "status"}, {"--check", "check"}}});
  for (const auto add : {add_batch_run, add_batch_status, add_batch_merge, add_batch_check})
    add(program, chosen);
}

}  // namespace qjulia::tools
