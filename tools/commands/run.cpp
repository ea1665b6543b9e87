/// qjulia run: what a command made, or a job, in; the same made again out.

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "base/file_types.hpp"
#include "base/input_file.hpp"
#include "base/output_check.hpp"
#include "base/text.hpp"
#include "base/toml.hpp"
#include "commands/commands.hpp"
#include "describe/files.hpp"
#include "describe/notes.hpp"
#include "jobs/job_run.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/version.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/map/map_file.hpp"

namespace qjulia::tools {
namespace {

struct RunArguments {
  std::string file;
  std::string output;  ///< empty: it is named after the file, or by the job's command
  std::string inputs;  ///< folder; empty: none but the file's and this one
  std::vector<std::pair<std::string, std::string>> changes;  ///< options and their values
  bool takes_changed = false, prints = false;
  TrustedDevice device;
};

/// A job, and the file it came from.
struct Found {
  Job job;
  bool is_written_by_hand = false;  ///< it is no artefact: its files may lie in folders
  bool holds_map = false;           ///< that the job made, with its knobs turned
};

nlohmann::json parsed(const std::string& text, const std::string& file) {
  auto json = base::is_json_too_deep(text) ? nlohmann::json(nlohmann::json::value_t::discarded)
                                           : nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) throw InputError(fmt::format("'{}' is not JSON", file));
  return json;
}

nlohmann::json toml_job(const std::string& text, const std::string& file) {
  std::ostringstream json;
  json << toml::json_formatter(base::parse_toml(text, file));
  return parsed(json.str(), file);
}

/// A job, a report that a command wrote with --json, or a map.
Found job_in_json(const std::string& file, const std::stop_token& stop) {
  constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 30;
  const nlohmann::json json = parsed(base::read_text_file(file, "job", kLargestFile, stop), file);
  if (json.contains("command")) {
    return {job_from_json(json, file), true, false};
  }
  if (json.contains("made_with") && json["made_with"].contains("job")) {
    return {job_from_json(json["made_with"]["job"], file), false, false};
  }
  return {job_from_json(last_job(map_from_json(json, file), file), file), false, false};
}

Found read_job(const std::string& file, const std::stop_token& stop) {
  constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 20;
  const std::string extension = base::extension_of(file);
  if (extension == ".toml") {
    const std::string text = base::read_text_file(file, "job", kLargestFile, stop);
    return {job_from_json(toml_job(text, file), file), true, false};
  }
  if (extension == ".json") return job_in_json(file, stop);
  if (extension == ".html") {
    return {job_from_json(last_job(read_map(file, stop), file), file), false, true};
  }
  if (!base::can_hold_note(file)) {
    throw InputError(fmt::format(
        "'{}': files of this type have no room for the command that made them; what the command "
        "prints with --json has it",
        file));
  }
  const nlohmann::json made = embedded_note(file, stop).at("made_with");
  if (!made.contains("job")) {
    throw InputError(fmt::format("'{}' does not say which command made it", file));
  }
  return {job_from_json(made["job"], file), false, holds_map(file, stop)};
}

/// Gives the job's options other values.
void change(Job& job, const RunArguments& arguments, const CommandUsage& usage) {
  for (const auto& [given, text] : arguments.changes) {
    const std::string name = job_name(given);
    const OptionUsage& option = option_named(usage, name);
    job.inputs.erase(name);
    if (option.completion.takes_files && !text.empty()) job.inputs[name].path = text;
    if (text.empty()) {
      job.options.erase(name);
    } else if (option.values.empty() && !option.is_positional) {
      if (text != "true" && text != "false") {
        throw InputError(fmt::format("{}={}: give true or false", given, text));
      }
      job.options[name] = text == "true";
    } else {
      const auto words = option.values.size() > 1 ? base::split(text, ' ') : std::vector{text};
      job.options[name] = job_value(words, false);
    }
  }
}

/// Finds the files that a job reads.
class InputFinder {
 public:
  InputFinder(const RunArguments& arguments, const Found& found, Session& session)
      : arguments_(arguments), found_(found), session_(session) {
    if (!arguments.inputs.empty()) folders_.emplace_back(arguments.inputs);
    folders_.push_back(std::filesystem::path(arguments.file).parent_path());
    folders_.emplace_back();
  }

  /// Where the file lies that an option names. None where the option's value is no file's name.
  /// @throws InputError where it was a file that is not found or has changed
  std::optional<std::filesystem::path> find(const OptionUsage& option, Job::Input& input) const {
    const std::string name = found_.job.options.at(job_name(option.name)).get<std::string>();
    const bool is_file = option.is_positional || !input.hash.empty();
    if (!input.path.empty()) return input.path;  // given on the command line
    if (!found_.is_written_by_hand && name != name_of(name)) {
      throw InputError(
          fmt::format("the job in '{}' reads '{}'; such a job calls files by their "
                      "names alone",
                      arguments_.file, name));
    }
    std::optional<std::filesystem::path> changed;
    for (const std::filesystem::path& folder : folders_) {
      std::error_code ignored;
      const std::filesystem::path path = folder / name;
      if (!std::filesystem::exists(path, ignored)) continue;
      if (input.hash.empty() || file_hash(path) == input.hash) return path;
      if (!changed) changed = path;
    }
    if (!is_file) return std::nullopt;
    if (changed && arguments_.takes_changed) {
      session_.console.warn(fmt::format("'{}' has changed since the job ran", changed->string()));
      input.hash.clear();
      return changed;
    }
    if (found_.holds_map && option.is_positional) {
      session_.console.note(fmt::format("'{}' is not here as it was: its map is taken from '{}'",
                                        name, arguments_.file));
      return arguments_.file;
    }
    if (changed) {
      throw InputError(
          fmt::format("'{}' has changed since the job ran; --inputs says where the "
                      "right one lies, and --changed takes this one",
                      changed->string()));
    }
    throw InputError(
        fmt::format("the job reads '{}', which lies neither in this folder nor beside "
                    "'{}'; --inputs says where it lies",
                    name, arguments_.file));
  }

 private:
  const RunArguments& arguments_;
  const Found& found_;
  Session& session_;
  std::vector<std::filesystem::path> folders_;
};

/// The job with the files that it reads where they lie now.
/// @param kept what the new file will say: the same job, which calls files by their names.
Job located(const Found& found, Job& kept, const CommandUsage& usage, const RunArguments& arguments,
            Session& session) {
  const InputFinder finder(arguments, found, session);
  Job job = found.job;
  for (const OptionUsage& option : usage.options) {
    const std::string name = job_name(option.name);
    if (!option.completion.takes_files || !job.options.contains(name)) continue;
    if (!job.options.at(name).is_string()) {
      throw InputError(fmt::format("the job in '{}': '{}' must be text", arguments.file, name));
    }
    const auto path = finder.find(option, kept.inputs[name]);
    if (!path) {
      kept.inputs.erase(name);
      continue;
    }
    job.options[name] = path->string();
    kept.options[name] = name_of(found.job.options.at(name).get<std::string>());
    kept.inputs[name].path = *path;
    if (*path != arguments.file || !option.is_positional) continue;
    // In this map the knobs are turned already.
    for (const Knob& knob : knob_table()) job.options.erase(knob.name);
  }
  return job;
}

/// What the file is called that is made again; empty where the command names it.
std::string output_name(const RunArguments& arguments, const Found& found,
                        const CommandUsage& usage) {
  if (!arguments.output.empty()) return arguments.output;
  const OptionUsage* const output = output_of(usage);
  const std::string extension = base::extension_of(arguments.file);
  const bool is_report = extension == ".json" && !base::content_of(arguments.file);
  if (found.is_written_by_hand || is_report || output == nullptr) return {};
  const bool is_map = extension == ".json";
  std::string name = named_after(arguments.file, ".again" + (is_map ? ".qjulia.json" : extension));
  base::check_writable({"--output", name, {}, false, true});
  return name;
}

void say_what_differs(const Job& job, Session& session) {
  if (!job.version.empty() && job.version != version()) {
    session.console.warn(fmt::format(
        "the job was written by version {}, and this is {}, which may make something else of it",
        job.version, version()));
  }
}

int run_run(const RunArguments& arguments, Session& session) {
  Found found = read_job(arguments.file, session.stop());
  const CommandUsage usage = command_usage(found.job.command);
  if (output_of(usage) == nullptr) {
    throw InputError(fmt::format("the job in '{}' runs '{}', which makes no file", arguments.file,
                                 found.job.command));
  }
  change(found.job, arguments, usage);
  if (arguments.prints) {
    session.console.result(to_json(found.job).dump(2), to_json(found.job));
    return kDone;
  }
  say_what_differs(found.job, session);
  Job kept = found.job;
  kept.version.clear();
  const Job job = located(found, kept, usage, arguments, session);
  const std::string output = output_name(arguments, found, usage);
  const JobRun ready = [&] {
    try {
      return JobRun(job, output, arguments.device);
    } catch (const InputError& error) {
      throw InputError(fmt::format("the job in '{}': {}", arguments.file, error.what()));
    }
  }();
  session.begin(kept);
  return ready.run(session);
}

void describe_run(Command command, RunArguments& a) {
  command
      .input("FILE", a.file,
             "What to make again: a picture, mesh, map, field or page that a command wrote; what a "
             "command printed with --json; or a job (.toml or .json)")
      .offers_files();
  const auto take_change = [&a](const std::string& text) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw InputError(fmt::format("'{}' is not NAME=VALUE, such as zoom=6", text));
    }
    a.changes.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  };
  command.words("CHANGES", take_change,
                "NAME=VALUE, options that get another value than in the job, such as "
                "size=3840x2160 or 'phase=0.8 0.6 0 0'; flags take true or false; NAME= alone "
                "leaves the option out");
  command.file("-o,--output", a.output, "OUT",
               "File to write. Default: FILE's name with .again before its extension, in this "
               "folder, where a file that exists is not replaced; for a job what its command would "
               "choose");
  command
      .file("--inputs", a.inputs, "FOLDER",
            "Where the files lie that the job reads. They are looked for there, beside FILE and in "
            "this folder, and told by the hashes of their bytes")
      .offers_folders();
  command.flag("--changed", a.takes_changed,
               "Take files of the right name, although their bytes have changed");
  command.flag("--print", a.prints, "Print the job, and do nothing");
  add_device_to_use(command, a.device);
}

}  // namespace

void add_run(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"run", "Make again what a command made", R"(Examples:
  qjulia run bunny.png -o again.png               the same picture, bit for bit
  qjulia run bunny.png size=3840x2160 -o big.png  the same, larger
  qjulia run bunny.qjulia.json --print            the fit's job
  qjulia run job.toml
Files that commands write hold the command and its options if their type has room for them, as
pictures, maps, pages and most meshes and fields have. On the same device the same bytes come out, but for the
times in fitted maps and for fits that their time limit ended. A job in TOML:
  command = "render"
  options = { map = "bunny.qjulia.json", zoom = 6, material = "trap" })",
               /*can_trace=*/true,
               /*can_profile=*/true},
              describe_run, run_run);
}

}  // namespace qjulia::tools
