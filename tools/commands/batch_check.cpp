/// qjulia batch check: is anything wrong with a manifest?

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "commands/batch_commands.hpp"

namespace qjulia::tools {
namespace {

struct ManifestCheckArguments {
  std::string manifest;
};

int run_check(const ManifestCheckArguments& arguments, Session& session) {
  const auto fits = read_manifest(arguments.manifest, false, session.stop()).entries.size();
  session.console.result(
      fmt::format("{}: {} fit{}, nothing wrong", arguments.manifest, fits, fits == 1 ? "" : "s"),
      {{"manifest", arguments.manifest}, {"fits", fits}});
  return kDone;
}

void describe_check(Command command, ManifestCheckArguments& a) {
  add_manifest(command, a.manifest);
}

}  // namespace

void add_batch_check(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"batch check", "Check a manifest without fitting", R"(Example:
  qjulia batch check shapes.toml
It looks for the meshes, and reads every option, but fits nothing.)",
               /*can_trace=*/false},
              describe_check, run_check);
}

}  // namespace qjulia::tools
