#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <array>
#include <map>

#include "base/input_file.hpp"
#include "base/text.hpp"
#include "base/toml.hpp"
#include "batch/batch.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"

namespace qjulia::batch {
namespace {

std::size_t line_of(const toml::source_region& region) { return region.begin.line; }

/// What one table says, [defaults] or a [[fit]].
struct Section {
  std::size_t line = 0;
  std::optional<std::string> mesh;
  std::optional<std::string> name;
  BatchOutputs outputs;
  std::vector<ManifestOption> options;
};

/// Text that names and options can be: none with NUL, which ends a name for the system.
std::optional<std::string> plain_text(const toml::node& node) {
  auto text = node.value<std::string>();
  if (text && text->find('\0') != std::string::npos) return std::nullopt;
  return text;
}

/// A number or text as the command line would have it.
std::optional<std::string> as_text(const toml::node& node) {
  if (node.is_string()) return plain_text(node);
  if (const auto* whole = node.as_integer()) return fmt::format("{}", whole->get());
  if (const auto* real = node.as_floating_point()) return fmt::format("{}", real->get());
  return std::nullopt;
}

/// A pattern that matches this text alone.
std::string escaped(const std::string& text) {
  std::string pattern;
  for (const char c : text) {
    if (std::string_view("*?[\\").find(c) != std::string_view::npos) pattern += '\\';
    pattern += c;
  }
  return pattern;
}

bool is_other_than_file(const std::filesystem::path& path) {
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
}

/// Mesh files (by extension) that match, sorted; relative patterns begin at `folder`.
std::vector<std::filesystem::path> find_meshes(const std::filesystem::path& folder,
                                               const std::string& pattern) {
  std::vector<std::filesystem::path> found;
  glob_t matches{};
  if (::glob((escaped(folder.string()) / std::filesystem::path(pattern)).c_str(), 0, nullptr,
             &matches) == 0) {
    for (std::size_t i = 0; i < matches.gl_pathc; ++i) found.emplace_back(matches.gl_pathv[i]);
  }
  ::globfree(&matches);
  std::erase_if(found, [](const std::filesystem::path& path) {
    return !has_type(path, FileContent::mesh, FileUse::read) || is_other_than_file(path);
  });
  std::ranges::sort(found);
  return found;
}

/// What a fit of `mesh` is called: `name` with its asterisk replaced by the mesh's name without
/// extension; without a name, that.
std::string entry_name(const std::optional<std::string>& name, const std::filesystem::path& mesh) {
  std::string stem = base::to_utf8(mesh.stem().string());  // names stand in JSON
  if (!name) return stem;
  std::string result = *name;
  if (const auto star = result.find('*'); star != std::string::npos) result.replace(star, 1, stem);
  return result;
}

/// Why files cannot be called so; empty when they can.
std::string name_problem(const std::string& name) {
  constexpr std::array kTaken = {"batch", "summary", "contact_sheet"};
  constexpr std::size_t kLongest = 200;
  if (name.empty() || name.front() == '.') return "it must not be empty or begin with a dot";
  if (name.size() > kLongest) return fmt::format("it is longer than {} bytes", kLongest);
  if (std::ranges::any_of(name, [](unsigned char c) { return c == '/' || c == '*' || c < ' '; })) {
    return "it must not have a slash, a second asterisk or control characters";
  }
  if (std::ranges::find(kTaken, name) != kTaken.end()) return "the batch's own files have it";
  return {};
}

class Reader {
 public:
  Reader(std::filesystem::path file, const FitOptionsCheck& check, bool meshes_may_be_missing,
         std::stop_token stop)
      : check_(check), meshes_may_be_missing_(meshes_may_be_missing), stop_(std::move(stop)) {
    manifest_.file = std::move(file);
  }

  Manifest read() {
    const toml::table root = parse();
    Section defaults;
    std::size_t fits = 0;
    for (auto&& [key, node] : root) {
      const std::size_t line = line_of(key.source());
      if (key.str() == "defaults" && node.is_table()) {
        defaults = read_section(*node.as_table(), {}, false);
      } else if (key.str() == "fit" && node.is_array_of_tables()) {
        fits = node.as_array()->size();
      } else {
        complain(line, fmt::format("'{}' is not known here; a manifest has one [defaults] and "
                                   "any number of [[fit]]",
                                   key.str()));
      }
    }
    if (fits == 0) complain(1, "there is nothing to fit; add a [[fit]] with a mesh");
    for (std::size_t i = 0; i < fits; ++i) add_entries(*root["fit"][i].as_table(), defaults);
    raise_problems();
    return std::move(manifest_);
  }

 private:
  void complain(std::size_t line, std::string what) { problems_.emplace(line, std::move(what)); }

  /// @throws InputError listing every problem, if there is any.
  void raise_problems() const {
    std::string text;
    for (const auto& [line, what] : problems_) {
      text +=
          fmt::format("{}{}:{}: {}", text.empty() ? "" : "\n", manifest_.file.string(), line, what);
    }
    if (!text.empty()) throw InputError(text);
  }

  toml::table parse() const {
    constexpr std::uint64_t kLargestFile = std::uint64_t{16} << 20;
    return base::parse_toml(base::read_text_file(manifest_.file, "manifest", kLargestFile, stop_),
                            manifest_.file.string());
  }

  /// @param base what holds unless the table says otherwise.
  Section read_section(const toml::table& table, const Section& base, bool is_fit) {
    Section section;
    section.line = line_of(table.source());
    section.outputs = base.outputs;
    std::vector<std::string> unset;
    for (auto&& [key, node] : table) {
      const std::string name(key.str());
      const std::size_t line = line_of(key.source());
      if (name == "mesh" || name == "name") {
        if (!is_fit) {
          complain(line, fmt::format("'{}' belongs in a [[fit]], not in [defaults]", name));
          continue;
        }
        const auto text = plain_text(node);
        if (!text || text->empty()) {
          complain(line, fmt::format("'{}' must be text, without NUL", name));
          continue;
        }
        (name == "mesh" ? section.mesh : section.name) = *text;
      } else if (!read_output(name, node, line, section.outputs)) {
        if (!read_option(name, node, line, section.options)) unset.push_back(dashed(name));
      }
    }
    for (const ManifestOption& option : base.options) {
      const bool overridden = std::ranges::find(section.options, option.name,
                                                &ManifestOption::name) != section.options.end();
      if (!overridden && std::ranges::find(unset, option.name) == unset.end()) {
        section.options.push_back(option);
      }
    }
    return section;
  }

  static std::string dashed(std::string name) {
    std::ranges::replace(name, '_', '-');
    return name;
  }

  /// Whether the key is one of outputs.
  bool read_output(const std::string& name, const toml::node& node, std::size_t line,
                   BatchOutputs& outputs) {
    if (name == "surface") {
      if (const auto* wanted = node.as_boolean()) {
        outputs.surface = wanted->get() ? std::optional<std::string>(".ply") : std::nullopt;
      } else if (const auto kind = node.value<std::string>();
                 kind && has_type("surface." + *kind, FileContent::mesh, FileUse::write)) {
        outputs.surface = extension_of("surface." + *kind);
      } else {
        complain(line,
                 "'surface' must be true, false, \"ply\", \"obj\", \"stl\", \"off\", \"glb\", "
                 "\"3mf\" or \"usda\"");
      }
    } else if (name == "surface_resolution") {
      read_whole(node, 2, 8192, line, "'surface_resolution'", outputs.surface_resolution);
    } else if (name == "picture") {
      read_flag(node, line, "'picture'", outputs.picture);
    } else if (name == "report") {
      read_flag(node, line, "'report'", outputs.report);
    } else if (name == "picture_size") {
      const toml::array* size = node.as_array();
      if (size == nullptr || size->size() != 2) {
        complain(line, "'picture_size' must be width and height, such as [640, 480]");
        return true;
      }
      read_whole((*size)[0], 1, 16384, line, "the width of 'picture_size'", outputs.picture_width);
      read_whole((*size)[1], 1, 16384, line, "the height of 'picture_size'",
                 outputs.picture_height);
    } else {
      return false;
    }
    return true;
  }

  void read_flag(const toml::node& node, std::size_t line, const char* what, bool& value) {
    if (node.is_boolean()) {
      value = *node.value<bool>();
    } else {
      complain(line, fmt::format("{} must be true or false", what));
    }
  }

  void read_whole(const toml::node& node, int low, int high, std::size_t line, const char* what,
                  int& value) {
    const auto given = node.is_integer() ? node.value<std::int64_t>() : std::nullopt;
    if (given && *given >= low && *given <= high) {
      value = static_cast<int>(*given);
    } else {
      complain(line, fmt::format("{} must be a whole number, {} to {}", what, low, high));
    }
  }

  /// Whether the option is set: false for a flag that is not.
  bool read_option(const std::string& name, const toml::node& node, std::size_t line,
                   std::vector<ManifestOption>& options) {
    ManifestOption option{dashed(name), {}, line};
    if (const auto* flag = node.as_boolean()) {
      if (!flag->get()) return false;
    } else if (const auto text = as_text(node)) {
      const bool is_file = name == "schedule" && text->ends_with(".toml");
      option.values.push_back(is_file ? (folder() / *text).string() : *text);
    } else {
      complain(line,
               fmt::format("'{}' must be a number, a string without NUL, true or false", name));
      return true;
    }
    try {
      check_({option});
      options.push_back(std::move(option));
    } catch (const InputError& error) {
      complain(line, error.what());
    }
    return true;
  }

  std::filesystem::path folder() const { return manifest_.file.parent_path(); }

  /// Why this cannot be a mesh; empty when it can.
  std::string mesh_problem(const std::filesystem::path& mesh) const {
    if (!has_type(mesh, FileContent::mesh, FileUse::read)) {
      return fmt::format("mesh '{}' must be a file whose name ends in {}", mesh.string(),
                         extension_list(FileContent::mesh, FileUse::read));
    }
    if (is_other_than_file(mesh)) {
      return fmt::format("mesh '{}' is a folder, pipe or device; give a regular file",
                         mesh.string());
    }
    std::error_code ignored;
    if (meshes_may_be_missing_ || std::filesystem::exists(mesh, ignored)) return {};
    return fmt::format("there is no mesh '{}'", mesh.string());
  }

  void add_entries(const toml::table& table, const Section& defaults) {
    const Section section = read_section(table, defaults, true);
    if (!section.mesh) {
      complain(section.line, "this [[fit]] has no 'mesh': a path, or a glob such as *.obj");
      return;
    }
    std::vector<std::filesystem::path> meshes{folder() / *section.mesh};
    const bool is_glob = section.mesh->find_first_of("*?[") != std::string::npos;
    std::error_code ignored;  // a glob may be longer than any name
    if (is_glob && !std::filesystem::exists(meshes.front(), ignored)) {
      meshes = find_meshes(folder(), *section.mesh);
      if (meshes.empty() && !meshes_may_be_missing_) {
        complain(section.line, fmt::format("no mesh matches '{}'", *section.mesh));
      }
      if (meshes.size() > 1 && section.name && section.name->find('*') == std::string::npos) {
        complain(section.line,
                 fmt::format("'{}' matches {} meshes, which cannot all be named '{}'; put an "
                             "asterisk where each mesh's own name shall stand",
                             *section.mesh, meshes.size(), *section.name));
        return;
      }
    } else if (const auto problem = mesh_problem(meshes.front()); !problem.empty()) {
      complain(section.line, problem);
    }
    try {
      check_(section.options);
    } catch (const InputError& error) {
      complain(section.line, error.what());
    }
    for (const auto& mesh : meshes) add_entry(section, mesh);
  }

  void add_entry(const Section& section, const std::filesystem::path& mesh) {
    const std::string name = entry_name(section.name, mesh);
    if (const std::string problem = name_problem(name); !problem.empty()) {
      complain(section.line, fmt::format("a fit cannot be named '{}': {}", name, problem));
      return;
    }
    const auto [first, added] = lines_.try_emplace(name, section.line);
    if (!added) {
      complain(section.line, fmt::format("'{}' is the name of the fit in line {} too; give "
                                         "one of them a 'name' of its own",
                                         name, first->second));
      return;
    }
    manifest_.entries.push_back({name, mesh, section.options, section.outputs, section.line});
  }

  const FitOptionsCheck& check_;
  bool meshes_may_be_missing_;
  Manifest manifest_;
  std::stop_token stop_;
  std::multimap<std::size_t, std::string> problems_;  ///< by line
  std::map<std::string, std::size_t> lines_;          ///< where entries were met, by name
};

}  // namespace

Manifest read_manifest(const std::filesystem::path& file, const FitOptionsCheck& check,
                       bool meshes_may_be_missing, std::stop_token stop) {
  return Reader(file, check, meshes_may_be_missing, std::move(stop)).read();
}

}  // namespace qjulia::batch
