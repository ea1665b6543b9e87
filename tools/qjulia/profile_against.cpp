#include "profile_against.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "benchmark/alternated.hpp"
#include "child_output.hpp"
#include "failure.hpp"
#include "profile_compare.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

/// This program, however it was found.
constexpr const char* kThisProgram = "/proc/self/exe";

/// A profile that failed, with an error of the kind that its exit code names.
[[noreturn]] void throw_failure(const std::string& program, const ChildOutput& child) {
  const std::string what = fmt::format("'{} profile' ended with code {}: {}", program,
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
          fmt::format("'{} profile' printed no profile; give a build of qjulia", program));
    default:
      throw InputError(what);
  }
}

nlohmann::json profile_once(const std::string& program, std::vector<std::string> words,
                            const std::stop_token& stop) {
  words.insert(words.begin(), {program, "profile"});
  words.insert(words.end(), {"--json", "--quiet"});
  const ChildOutput child = child_output(words, stop);
  nlohmann::json json = nlohmann::json::parse(child.out, nullptr, false);
  if (child.exit_code != 0 || json.is_discarded() || !json.contains("kernels")) {
    throw_failure(program, child);
  }
  return json;
}

/// Builds older than the option cannot leave out kernels that are decided.
bool can_choose_kernels(const std::string& program, const std::stop_token& stop) {
  const ChildOutput help = child_output({program, "profile", "--help"}, stop);
  return help.out.find("--kernels") != std::string::npos;
}

}  // namespace

int profile_against(const AgainstArguments& arguments, Session& session) {
  const std::stop_token stop = session.interrupts.token();
  const bool chooses = !arguments.names_kernels && can_choose_kernels(arguments.other, stop);
  const auto once = [&](const std::string& program) {
    return [&, program](const std::vector<std::string>& names) {
      std::vector<std::string> words = arguments.words;
      if (chooses && !names.empty()) {
        std::string list;
        for (const std::string& name : names) list += (list.empty() ? "" : ",") + name;
        words.insert(words.end(), {"--kernels", list});
      }
      return profile_once(program, words, stop);
    };
  };
  benchmark::Alternation builds;
  builds.old_build = once(arguments.other);
  builds.new_build = once(kThisProgram);
  builds.is_over = [&] { return session.seconds() > arguments.seconds; };
  builds.on_round = [&](int rounds, std::size_t open) {
    session.console.note(
        fmt::format("round {}: {} kernels undecided, {:.0f} s", rounds, open, session.seconds()));
  };
  const auto found = benchmark::compare_alternated(builds, arguments.comparison);
  return show_comparison(found.comparison, arguments.comparison,
                         {found.rounds, found.least_rounds, session.seconds()}, session);
}

}  // namespace qjulia::tools
