/// qjulia convert: a map of another program or version in, a map file out.

#include <fmt/format.h>

#include "commands.hpp"
#include "exit_code.hpp"
#include "files.hpp"
#include "map_options.hpp"
#include "options.hpp"
#include "provenance.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/original_file.hpp"

namespace qjulia::tools {
namespace {

struct ConvertArguments {
  std::string input;
  std::string output;
  std::string device;
  MapOptions map_options;
  std::optional<UpAxis> up;
};

RationalMap read_any(const std::string& file, const std::stop_token& stop) {
  return is_original_file(file) ? read_original(file) : read_map(file, stop);
}

int run_convert(const ConvertArguments& arguments, Session& session) {
  arguments.map_options.knobs.validate();
  session.check_outputs({arguments.input}, {{"OUT", arguments.output, {".json"}}});
  RationalMap map = read_any(arguments.input, session.interrupts.token());
  // A map that stays as it is needs no device.
  if (!arguments.map_options.given().empty()) {
    const Device device = session.open_device(arguments.device);
    map = with_knobs(device, map, arguments.map_options, arguments.input);
    map.provenance.set("turned", made_with(arguments.input, arguments.map_options, device.info()));
  } else if (is_original_file(arguments.input)) {
    map.provenance.set("converted", converted_from(arguments.input));
  }
  if (arguments.up) map.up = arguments.up;
  write_map(map, arguments.output);
  session.console.summary(fmt::format("{} factors\nmap: {}", map.factors.size(), arguments.output),
                          {{"map", arguments.output}, {"factors", map.factors.size()}});
  return kDone;
}

void describe_convert(Command command, ConvertArguments& a) {
  command.file("IN", a.input, "Map: .o3d of the original program, or .qjulia.json")
      .required()
      .type("");
  command.file("OUT", a.output, "Map file to write, such as bunny.qjulia.json").required().type("");
  add_up(command, a.up, "The shape's axis that points up; auto is what the map says");
  add_knobs(command, a.map_options);
  add_device(command, a.device);
}

}  // namespace

void add_convert(CommandLine& program, ChosenCommand& chosen) {
  const CommandText text{
      "convert", "Make a map file of another map",
      "Examples:\n"
      "  qjulia convert bunny.o3d bunny.qjulia.json      a map of the original program\n"
      "  qjulia convert bunny.qjulia.json crust.qjulia.json --drift 0.8 --detail 0.03\n"
      "  qjulia convert lying.qjulia.json standing.qjulia.json --up z\n"
      "The second writes a map with its settings baked in: 'surface' and 'render' make of it,\n"
      "without options, what they would make of the first with these.\n" +
          std::string(kMapOptionsHelp),
      /*can_trace=*/false};
  add_command(program, chosen, text, describe_convert, run_convert);
}

}  // namespace qjulia::tools
