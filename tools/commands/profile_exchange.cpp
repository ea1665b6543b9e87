/// qjulia profile export and import: a device's tuned settings as a file.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "commands/profile_commands.hpp"
#include "console/failure.hpp"
#include "qjulia/device/tuning_cache.hpp"

namespace qjulia::tools {
namespace {

struct ExchangeArguments {
  std::string file;
  TrustedDevice device;
};

void show(const Device& device, const std::string& text, const std::string& file,
          Session& session) {
  session.console.result(fmt::format("settings of '{}'{}: {}", device.info().name, text, file),
                         {{"device", device.info().name},
                          {"file", file},
                          {"single", to_json(device.tuning(Precision::single))},
                          {"double", to_json(device.tuning(Precision::dbl))}});
}

int run_export(const ExchangeArguments& arguments, Session& session) {
  session.check_outputs({{}, {{"FILE", arguments.file, {".json"}}}});
  const Device device = session.open_device(arguments.device);
  export_tuning(device, arguments.file);
  show(device, "", arguments.file, session);
  return kDone;
}

int run_import(const ExchangeArguments& arguments, Session& session) {
  session.check_outputs({{arguments.file}, {}});
  const Device device = import_tuning(session.open_device(arguments.device), arguments.file);
  show(device, " kept in", tuning_file(device.info()).string(), session);
  return kDone;
}

void describe_export(Command command, ExchangeArguments& a) {
  command.input("FILE", a.file, "What to write: .json").names_output().offers_files({".json"});
  add_device_to_use(command, a.device);
}

void describe_import(Command command, ExchangeArguments& a) {
  command.input("FILE", a.file, "A file of 'qjulia profile export'").offers_files({".json"});
  add_device_to_use(command, a.device);
}

}  // namespace

void add_profile_export(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"profile export", "Write a device's settings to a file for other machines",
               R"(Example:
  qjulia profile export settings.json       to send in, or for a twin of this machine)"},
              describe_export, run_export);
}

void add_profile_import(CommandLine& program, ChosenCommand& chosen) {
  add_command(
      program, chosen,
      {"profile import", "Use a device's settings from a file of 'profile export'", R"(Example:
  qjulia profile import settings.json
Every command uses them from then on, as if 'qjulia profile tune' had found them.)"},
      describe_import, run_import);
}

}  // namespace qjulia::tools
