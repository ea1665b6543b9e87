#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <string_view>

#include "base/file_types.hpp"
#include "base/glob.hpp"
#include "base/input_file.hpp"
#include "base/text.hpp"
#include "base/toml.hpp"
#include "batch/batch.hpp"
#include "batch/sweep.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/mesh/point_cache.hpp"

namespace qjulia::batch {
namespace {

std::size_t line_of(const toml::source_region& region) { return region.begin.line; }

enum class TableKind { defaults, fit, sweep };

/// What one table says, [defaults], a [[fit]] or a [[sweep]].
struct Section {
  TableKind kind = TableKind::defaults;
  std::size_t line = 0;
  std::vector<std::string> meshes;  ///< paths and globs
  bool is_sequence = false;         ///< the meshes are frames, each like the one before
  std::optional<std::string> name;
  BatchOutputs outputs;
  std::vector<ManifestOption> options;
  std::vector<SweepAxis> axes;
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

bool is_other_than_file(const std::filesystem::path& path) {
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  return std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
}

/// Mesh files (by extension) that match, sorted; relative patterns begin at `folder`.
std::vector<std::filesystem::path> find_meshes(const std::filesystem::path& folder,
                                               const std::string& pattern) {
  std::vector<std::filesystem::path> found = base::files_matching(folder, pattern);
  std::erase_if(found, [](const std::filesystem::path& path) {
    return !base::has_type(path, base::FileContent::mesh, base::FileUse::read) ||
           is_other_than_file(path);
  });
  std::ranges::sort(found);
  return found;
}

/// A mesh to fit: a file, or a frame of a point cache.
struct MeshPlace {
  std::filesystem::path file;
  std::optional<std::size_t> frame{};  ///< from 0 on
};

/// What a fit of `mesh` is called: `name` with its asterisk replaced by the mesh's name without
/// extension; without a name, that. Frames of a point cache count from 1, as files do.
std::string entry_name(const std::optional<std::string>& name, const MeshPlace& mesh) {
  std::string stem = base::to_utf8(mesh.file.stem().string());  // names stand in JSON
  if (mesh.frame) stem += fmt::format("_{:04}", *mesh.frame + 1);
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
  /// A key for an output of a fit besides its map. A list is a single value of such a key, also in
  /// a [[sweep]].
  struct OutputKey {
    std::string_view name;
    void (Reader::*read)(const toml::node& node, std::size_t line, BatchOutputs& outputs);
  };

  static std::span<const OutputKey> output_keys() {
    static constexpr std::array kKeys{
        OutputKey{"surface", &Reader::read_surface}, OutputKey{"picture", &Reader::read_picture},
        OutputKey{"report", &Reader::read_report}, OutputKey{"compare", &Reader::read_compare},
        OutputKey{"compare_resolution", &Reader::read_compare_resolution}};
    return kKeys;
  }

  Reader(std::filesystem::path file, const ManifestChecks& checks, bool meshes_may_be_missing,
         std::stop_token stop)
      : checks_(checks), meshes_may_be_missing_(meshes_may_be_missing), stop_(std::move(stop)) {
    manifest_.file = std::move(file);
  }

  Manifest read() {
    const toml::table root = parse();
    Section defaults;
    std::vector<std::pair<const toml::table*, TableKind>> tables;
    for (auto&& [key, node] : root) {
      const std::size_t line = line_of(key.source());
      const bool is_sweep = key.str() == "sweep";
      if (key.str() == "defaults" && node.is_table()) {
        defaults = read_section(*node.as_table(), {}, TableKind::defaults);
      } else if ((is_sweep || key.str() == "fit") && node.is_array_of_tables()) {
        for (const toml::node& table : *node.as_array()) {
          tables.emplace_back(table.as_table(), is_sweep ? TableKind::sweep : TableKind::fit);
        }
      } else {
        complain(line, fmt::format("'{}' is not known here; a manifest has one [defaults] and "
                                   "any number of [[fit]] and [[sweep]]",
                                   key.str()));
      }
    }
    if (tables.empty()) complain(1, "there is nothing to fit; add a [[fit]] with a mesh");
    std::ranges::stable_sort(tables, {},
                             [](const auto& table) { return line_of(table.first->source()); });
    for (const auto& [table, kind] : tables) add_entries(*table, defaults, kind);
    raise_problems();
    return std::move(manifest_);
  }

 private:
  /// Once, whatever many values or combinations have the same wrong.
  void complain(std::size_t line, const std::string& what) {
    const auto [first, last] = problems_.equal_range(line);
    if (std::any_of(first, last, [&](const auto& told) { return told.second == what; })) return;
    problems_.emplace(line, what);
  }

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
  Section read_section(const toml::table& table, const Section& base, TableKind kind) {
    Section section;
    section.kind = kind;
    section.line = line_of(table.source());
    section.outputs = base.outputs;
    std::vector<std::string> unset;
    for (auto&& [key, node] : table) {
      const std::string name(key.str());
      const std::size_t line = line_of(key.source());
      if (name == "mesh" || name == "sequence" || name == "name") {
        read_place(name, node, line, section);
      } else if (const OutputKey* output = output_key(name)) {
        (this->*output->read)(node, line, section.outputs);
      } else if (kind == TableKind::sweep && node.is_array()) {
        read_axis(name, *node.as_array(), line, section.axes);
      } else if (!read_option(name, node, line, section.options)) {
        unset.push_back(base::dashed(name));
      }
    }
    for (const SweepAxis& axis : section.axes) unset.push_back(axis.name);
    for (const ManifestOption& option : base.options) {
      const bool overridden = std::ranges::find(section.options, option.name,
                                                &ManifestOption::name) != section.options.end();
      if (!overridden && std::ranges::find(unset, option.name) == unset.end()) {
        section.options.push_back(option);
      }
    }
    return section;
  }

  /// 'mesh', 'sequence' and 'name'.
  void read_place(const std::string& key, const toml::node& node, std::size_t line,
                  Section& section) {
    if (section.kind == TableKind::defaults) {
      complain(line, fmt::format("'{}' belongs in a [[fit]], not in [defaults]", key));
      return;
    }
    const toml::array* list =
        key != "name" && section.kind == TableKind::sweep ? node.as_array() : nullptr;
    if (key == "sequence") section.is_sequence = true;
    if (list != nullptr && list->empty()) complain(line, fmt::format("'{}' is an empty list", key));
    const std::size_t count = list == nullptr ? 1 : list->size();
    for (std::size_t i = 0; i < count; ++i) {
      const auto text = plain_text(list == nullptr ? node : (*list)[i]);
      if (!text || text->empty()) {
        complain(line, fmt::format("'{}' must be text, without NUL", key));
      } else if (key == "name") {
        section.name = *text;
      } else {
        section.meshes.push_back(*text);
      }
    }
  }

  /// An option's list of values.
  void read_axis(const std::string& name, const toml::array& list, std::size_t line,
                 std::vector<SweepAxis>& axes) {
    SweepAxis axis{base::dashed(name), {}};
    if (list.empty()) {
      complain(line, fmt::format("'{}' is an empty list; give values, or leave it out", name));
    }
    for (const toml::node& node : list) {
      const auto value = read_value(name, node, line);
      if (!value) continue;
      if (std::ranges::find(axis.values, value->label, &AxisValue::label) != axis.values.end()) {
        complain(line, fmt::format("'{}' lists two values that names of fits would both call '{}'; "
                                   "leave one out",
                                   name, value->label));
        continue;
      }
      axis.values.push_back(*value);
    }
    axes.push_back(std::move(axis));
  }

  static const OutputKey* output_key(const std::string& name) {
    const auto keys = output_keys();
    const auto found = std::ranges::find(keys, name, &OutputKey::name);
    return found == keys.end() ? nullptr : &*found;
  }

  /// The extension of a surface's type, such as "stl"; none where there is no such type.
  /// @param what begins what is said then.
  std::optional<std::string> surface_type(const toml::node& node, std::size_t line,
                                          const char* what) {
    const auto type = node.value<std::string>();
    const std::filesystem::path file = "surface." + type.value_or("");
    const bool is_known = base::has_type(file, base::FileContent::mesh, base::FileUse::write) ||
                          base::has_type(file, base::FileContent::volume, base::FileUse::write);
    if (type && is_known) return base::extension_of(file);
    std::string types;
    for (const base::FileContent content : {base::FileContent::mesh, base::FileContent::volume}) {
      for (const std::string& extension : base::extensions(content, base::FileUse::write)) {
        types += fmt::format("{}\"{}\"", types.empty() ? "" : ", ", extension.substr(1));
      }
    }
    complain(line, fmt::format("{} one of {}", what, types));
    return std::nullopt;
  }

  /// Gives a job options over those that it has, which stay where these are refused.
  void read_job(const toml::table& table, std::size_t line, EntryJob& job) {
    std::ostringstream text;
    text << toml::json_formatter(table);
    EntryJob changed = job;
    changed.options.update(nlohmann::json::parse(text.str()));
    try {
      checks_.job(changed, folder());
      job = std::move(changed);
    } catch (const InputError& error) {
      complain(line, fmt::format("{}: {}", job.command, error.what()));
    }
  }

  void read_surface(const toml::node& node, std::size_t line, BatchOutputs& outputs) {
    std::optional<EntryJob>& job = outputs.surface;
    if (const auto* wanted = node.as_boolean(); wanted != nullptr && !wanted->get()) {
      job.reset();
      return;
    }
    if (!job) job = EntryJob{"surface", ".ply"};
    if (node.is_boolean()) return;
    const toml::table* const table = node.as_table();
    toml::table options = table == nullptr ? toml::table() : *table;
    if (table == nullptr) {
      job->extension = surface_type(node, line,
                                    "'surface' must be true, false, a table of options of 'qjulia "
                                    "surface', or")
                           .value_or(job->extension);
    }
    if (const toml::node* const type = options.get("type")) {
      job->extension = surface_type(*type, line, "'type' must be").value_or(job->extension);
      options.erase("type");
    }
    read_job(options, line, *job);
  }

  void read_picture(const toml::node& node, std::size_t line, BatchOutputs& outputs) {
    std::optional<EntryJob>& job = outputs.picture;
    if (!node.is_boolean() && !node.is_table()) {
      complain(line, "'picture' must be true or false, or a table of options of 'qjulia render'");
      return;
    }
    if (const auto* wanted = node.as_boolean(); wanted != nullptr && !wanted->get()) {
      job.reset();
      return;
    }
    if (!job) job = EntryJob{"render", ".png", {{"size", "640x480"}}};
    if (node.is_table()) read_job(*node.as_table(), line, *job);
  }

  void read_report(const toml::node& node, std::size_t line, BatchOutputs& outputs) {
    read_flag(node, line, "'report'", outputs.report);
  }

  void read_compare_resolution(const toml::node& node, std::size_t line, BatchOutputs& outputs) {
    read_whole(node, 8, 1024, line, "'compare_resolution'", outputs.compare_resolution);
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

  /// The n of comparisons: a number or a list of them.
  void read_compare(const toml::node& node, std::size_t line, BatchOutputs& outputs) {
    const toml::array* list = node.as_array();
    const std::size_t count = list == nullptr ? 1 : list->size();
    std::vector<int> read;
    for (std::size_t i = 0; i < count; ++i) {
      int n = 0;
      read_whole(list == nullptr ? node : (*list)[i], 1, kMostIterations, line,
                 "each n of 'compare'", n);
      if (n > 0 && std::ranges::find(read, n) != read.end()) {
        complain(line, fmt::format("'compare' lists {} twice", n));
      }
      if (n > 0) read.push_back(n);
    }
    std::ranges::sort(read);
    outputs.compare = std::move(read);
  }

  /// Returns the value of an option. A value of the wrong type, or one that is refused, is
  /// reported, and the result is empty.
  std::optional<AxisValue> read_value(const std::string& name, const toml::node& node,
                                      std::size_t line) {
    ManifestOption option{base::dashed(name), {}, line};
    std::string label = "true";
    if (const auto* flag = node.as_boolean()) {
      if (!flag->get()) return AxisValue{"false", std::nullopt};
    } else if (const auto text = as_text(node)) {
      const bool is_file = name == "schedule" && text->ends_with(".toml");
      label = is_file ? std::filesystem::path(*text).stem().string() : *text;
      option.values.push_back(is_file ? (folder() / *text).string() : *text);
    } else {
      complain(line, fmt::format("'{}' must be a number, a string without NUL, true or false{}",
                                 name, node.is_array() ? "; lists belong in a [[sweep]]" : ""));
      return std::nullopt;
    }
    try {
      checks_.options({option});
      return AxisValue{label_in_name(label), std::move(option)};
    } catch (const InputError& error) {
      complain(line, error.what());
      return std::nullopt;
    }
  }

  /// Whether the option is set: false for a flag that is not.
  bool read_option(const std::string& name, const toml::node& node, std::size_t line,
                   std::vector<ManifestOption>& options) {
    const auto value = read_value(name, node, line);
    if (!value) return true;
    if (!value->option) return false;
    options.push_back(*value->option);
    return true;
  }

  std::filesystem::path folder() const { return manifest_.file.parent_path(); }

  /// Why this cannot be a mesh; empty when it can.
  std::string mesh_problem(const std::filesystem::path& mesh) const {
    if (!base::has_type(mesh, base::FileContent::mesh, base::FileUse::read)) {
      return fmt::format("mesh '{}' must be a file whose name ends in {}", mesh.string(),
                         base::extension_list(base::FileContent::mesh, base::FileUse::read));
    }
    if (is_other_than_file(mesh)) {
      return fmt::format("mesh '{}' is a folder, pipe or device; give a regular file",
                         mesh.string());
    }
    std::error_code ignored;
    if (meshes_may_be_missing_ || std::filesystem::exists(mesh, ignored)) return {};
    return fmt::format("there is no mesh '{}'", mesh.string());
  }

  void add_entries(const toml::table& table, const Section& defaults, TableKind kind) {
    const Section section = read_section(table, defaults, kind);
    const char* const what = kind == TableKind::sweep ? "[[sweep]]" : "[[fit]]";
    if (section.meshes.empty()) {
      complain(section.line,
               fmt::format("this {} has no 'mesh': a path, or a glob such as *.obj", what));
      return;
    }
    if (section.is_sequence && table.contains("mesh")) {
      complain(section.line, fmt::format("this {} has 'mesh' and 'sequence'; give one of them, and "
                                         "another [[fit]] for the rest",
                                         what));
      return;
    }
    auto meshes = meshes_of(section);
    if (!meshes) return;
    if (section.is_sequence) {
      std::ranges::stable_sort(*meshes, [](const auto& one, const auto& other) {
        return base::comes_before(one.file.string(), other.file.string());
      });
      if (meshes->size() == 1) {
        complain(section.line, fmt::format("the sequence has one frame, '{}'; give a glob that "
                                           "matches all of them, a point cache of several, or "
                                           "'mesh' with one mesh's file",
                                           meshes->front().file.string()));
      }
    }
    if (combination_count(section.axes) > kMostFits / std::max<std::size_t>(meshes->size(), 1)) {
      complain(section.line, fmt::format("this {} makes more than {} fits; list fewer values, or "
                                         "divide the manifest",
                                         what, kMostFits));
      return;
    }
    std::vector<Combination> all = combinations(section.axes);
    for (Combination& one : all) {
      one.options.insert(one.options.end(), section.options.begin(), section.options.end());
      try {
        checks_.options(one.options);
      } catch (const InputError& error) {
        complain(section.line, error.what());
      }
    }
    const MeshPlace* before = nullptr;
    for (const MeshPlace& mesh : *meshes) {
      for (const Combination& one : all) add_entry(section, mesh, one, before);
      if (section.is_sequence) before = &mesh;
    }
  }

  /// All meshes of a section; nothing when they cannot be named.
  std::optional<std::vector<MeshPlace>> meshes_of(const Section& section) {
    std::vector<MeshPlace> meshes;
    for (const std::string& pattern : section.meshes) {
      const auto path = folder() / pattern;
      if (section.is_sequence && is_point_cache(path)) {
        std::error_code ignored;
        if (meshes_may_be_missing_ && !std::filesystem::exists(path, ignored)) continue;
        const std::size_t frames = frames_of(path, section);
        for (std::size_t frame = 0; frame < frames; ++frame) meshes.push_back({path, frame});
        if (frames == 0) return std::nullopt;
        continue;
      }
      const bool is_glob = pattern.find_first_of("*?[") != std::string::npos;
      std::error_code ignored;  // a glob may be longer than any name
      if (is_glob && !std::filesystem::exists(path, ignored)) {
        const auto found = find_meshes(folder(), pattern);
        if (found.empty() && !meshes_may_be_missing_) {
          complain(section.line, fmt::format("no mesh matches '{}'", pattern));
        }
        for (const auto& file : found) meshes.push_back({file});
        continue;
      }
      if (const auto problem = mesh_problem(path); !problem.empty()) {
        complain(section.line, problem);
      }
      meshes.push_back({path});
    }
    if (meshes.size() <= 1 || !section.name || section.name->find('*') != std::string::npos) {
      return meshes;
    }
    std::string patterns;
    for (const std::string& pattern : section.meshes) {
      patterns += fmt::format("{}'{}'", patterns.empty() ? "" : ", ", pattern);
    }
    complain(section.line,
             fmt::format("{} matches {} meshes, which cannot all be named '{}'; put an asterisk "
                         "where each mesh's own name should stand",
                         patterns, meshes.size(), *section.name));
    return std::nullopt;
  }

  /// How many frames a sequence's point cache has; 0 where it cannot be one, which is reported.
  std::size_t frames_of(const std::filesystem::path& path, const Section& section) {
    if (section.meshes.size() > 1) {
      complain(section.line, fmt::format("'{}' is a whole sequence; give it alone", path.string()));
      return 0;
    }
    try {
      const std::size_t frames = count_frames(path, stop_);
      if (frames <= kMostFits) return frames;
      complain(section.line, fmt::format("'{}' has {} frames; {} are the most", path.string(),
                                         frames, kMostFits));
    } catch (const InputError& error) {
      complain(section.line, error.what());
    }
    return 0;
  }

  /// @param before the frame before; null: there is none.
  void add_entry(const Section& section, const MeshPlace& mesh, const Combination& one,
                 const MeshPlace* before) {
    const std::string name = entry_name(section.name, mesh) + one.suffix;
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
    manifest_.entries.push_back({name, mesh.file, one.options, section.outputs, section.line});
    manifest_.entries.back().frame = mesh.frame;
    if (before != nullptr) {
      manifest_.entries.back().follows = entry_name(section.name, *before) + one.suffix;
    }
  }

  static constexpr std::size_t kMostFits = 100'000;  ///< of a table

  const ManifestChecks& checks_;
  bool meshes_may_be_missing_;
  Manifest manifest_;
  std::stop_token stop_;
  std::multimap<std::size_t, std::string> problems_;  ///< by line
  std::map<std::string, std::size_t> lines_;          ///< where entries were met, by name
};

}  // namespace

std::vector<std::string> manifest_keys() {
  std::vector<std::string> keys{"mesh", "sequence", "name"};
  for (const auto& output : Reader::output_keys()) keys.emplace_back(output.name);
  return keys;
}

Manifest read_manifest(const std::filesystem::path& file, const ManifestChecks& checks,
                       bool meshes_may_be_missing, std::stop_token stop) {
  return Reader(file, checks, meshes_may_be_missing, std::move(stop)).read();
}

}  // namespace qjulia::batch
