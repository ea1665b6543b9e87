/// qjulia profile against: this program and another build of it, profiled in turns.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/setting_json.hpp"
#include "benchmark/alternated.hpp"
#include "commands/profile_commands.hpp"
#include "commands/profile_compare.hpp"
#include "console/child_output.hpp"
#include "console/failure.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/profile/profile_settings.hpp"

namespace qjulia::tools {
namespace {

struct AgainstArguments {
  std::string other;  ///< the other build's program
  MeasuredArguments measured;
  ComparisonArguments comparison;
};

/// This program, however it was found.
constexpr const char* kThisProgram = "/proc/self/exe";

constexpr double kUsualLimit = 300;  ///< seconds

/// A profile that failed, with an error of the kind that its exit code names.
[[noreturn]] void throw_failure(const std::string& program, const ChildOutput& child) {
  const std::string what = fmt::format("'{} profile measure' ended with code {}: {}", program,
                                       child.exit_code, child.err.substr(0, child.err.find('\n')));
  switch (child.exit_code) {
    case kInterrupted:
      throw Interrupted();
    case kNoDevice:
      throw NoDeviceError(what);
    case kFailed:
      throw Error(what);
    case kDone:
      throw InputError(
          fmt::format("'{} profile measure' printed no profile; give a build of qjulia", program));
    default:
      throw InputError(what);
  }
}

nlohmann::json profile_once(const std::string& program, std::vector<std::string> words,
                            const std::stop_token& stop) {
  words.insert(words.begin(), {program, "profile", "measure"});
  words.insert(words.end(), {"--json", "--quiet"});
  const ChildOutput child = child_output(words, stop);
  nlohmann::json json = nlohmann::json::parse(child.out, nullptr, false);
  if (child.exit_code != 0 || json.is_discarded() || !json.contains("kernels")) {
    throw_failure(program, child);
  }
  return json;
}

/// What both programs get after 'profile measure'.
std::vector<std::string> words_of(const MeasuredArguments& arguments) {
  std::vector<std::string> words;
  for (const std::filesystem::path& file : inputs_of(arguments)) words.push_back(file.string());
  const auto add = [&](const std::string& option, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {option, value});
  };
  nlohmann::json given;  // also what is usual here: the other build may have another default
  base::add_json(given, profile_settings(), arguments.options);
  for (const std::string_view name : kSettingsOfMeasuring) {
    const Setting& setting = setting_named(profile_settings(), name, "profiles");
    const nlohmann::json& value = given[setting.name];
    if (name == "time_limit" || value.is_null()) continue;
    add("--" + setting.option(), value.is_string() ? value.get<std::string>() : value.dump());
  }
  add("--kernels", arguments.kernels);
  add("--device", arguments.device.name);
  add("--layout", arguments.device.layout);
  if (arguments.device.is_trusted) words.emplace_back("--trust-device");
  return words;
}

int run_against(const AgainstArguments& arguments, Session& session) {
  session.check_outputs({inputs_of(arguments.measured), {}});
  arguments.measured.options.validate();
  const benchmark::ComparisonOptions comparison = arguments.comparison.checked();
  const double limit = arguments.measured.options.time_limit.value_or(kUsualLimit);
  const std::stop_token stop = session.stop();
  const std::vector<std::string> given = words_of(arguments.measured);
  const auto once = [&](const std::string& program) {
    return [&, program](const std::vector<std::string>& open) {
      std::vector<std::string> words = given;
      if (arguments.measured.kernels.empty() && !open.empty()) {
        words.insert(words.end(), {"--kernels", fmt::format("{}", fmt::join(open, ","))});
      }
      return profile_once(program, words, stop);
    };
  };
  benchmark::Alternation builds;
  builds.old_build = once(arguments.other);
  builds.new_build = once(kThisProgram);
  builds.is_over = [&] { return session.seconds() > limit; };
  builds.on_round = [&](int rounds, std::size_t open) {
    session.console.note(
        fmt::format("round {}: {} kernels undecided, {:.0f} s", rounds, open, session.seconds()));
  };
  const auto found = benchmark::compare_alternated(builds, comparison);
  return show_comparison(found.comparison, comparison,
                         {found.rounds, found.least_rounds, session.seconds()}, session);
}

void describe_against(Command command, AgainstArguments& a) {
  command
      .input("PROGRAM", a.other,
             "Another build of qjulia, the older one; it must have 'profile measure'")
      .offers_files();
  add_measured_files(command, a.measured);
  add_kernels(command, a.measured);
  add_comparison(command, a.comparison);
  std::vector<std::string_view> names = kSettingsOfMeasuring;
  std::erase(names, "time_limit");
  add_measured(command, a.measured, names);
  Setting limit = with_help(setting_named(profile_settings(), "time_limit", "profiles"),
                            "Time after which it ends, also where kernels are undecided");
  limit.left_out = fmt::format("{}", kUsualLimit);
  add_setting(command, limit, &a.measured.options.time_limit);
}

}  // namespace

void add_profile_against(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"profile against", "Compare the kernels of two builds, measured in turns",
               std::string(R"(Example:
  qjulia profile against old/qjulia --time-limit 120
Profiles both builds in turns, each time in a new process, until every kernel is decided or time
is up. )") + kComparisonHelp,
               /*can_trace=*/false},
              describe_against, run_against);
}

}  // namespace qjulia::tools
