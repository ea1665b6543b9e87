/// qjulia batch: many meshes in, many maps out.

#include "batch_commands.hpp"
#include "fit_options.hpp"

namespace qjulia::tools {

void add_manifest(Command command, std::string& file) {
  command.input("MANIFEST", file, "What to fit: a TOML file, as in the example")
      .offers_files({".toml"});
}

batch::Manifest read_manifest(const std::string& file, bool may_miss_meshes,
                              const std::stop_token& stop) {
  const batch::FitOptionsCheck check = [](const std::vector<batch::ManifestOption>& options) {
    fit_options(options);
  };
  return batch::read_manifest(file, check, may_miss_meshes, stop);
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
  for (const auto add : {add_batch_run, add_batch_status, add_batch_check}) add(program, chosen);
}

}  // namespace qjulia::tools
