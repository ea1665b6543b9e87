#include "describe/fit_options.hpp"

#include "describe/setting_option.hpp"
#include "qjulia/fit/fit_settings.hpp"

namespace qjulia::tools {

void add_fit_options(Command command, FitOptions& options) {
  for (const FitSetting& setting : fit_settings()) {
    const ValuePlace place = setting.place(options);
    if (setting.name == "time_limit") {
      add_setting(command,
                  with_help(setting,
                            "Seconds of the whole command (with --resume, of this run); the map "
                            "reached by then is saved"),
                  place);
      continue;
    }
    const Option option = add_setting(command, setting, place);
    if (setting.name == "schedule") {
      option.offers({"tight", "fast", "paper", "follow"}).offers_files({".toml"});
    }
  }
}

}  // namespace qjulia::tools
