#include "qjulia/picture/look.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>

#include "base/input_file.hpp"
#include "base/setting_toml.hpp"
#include "picture/embedded_looks.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/light.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace qjulia {
namespace {

constexpr std::string_view kLooksFolder = "looks/", kLookEnding = ".toml";

/// The text of a built-in look; none where there is none of this name.
std::optional<std::string_view> look_text(std::string_view name) {
  const auto& all = picture::embedded_looks();
  const auto found = all.find(fmt::format("{}{}{}", kLooksFolder, name, kLookEnding));
  return found == all.end() ? std::nullopt : std::optional(found->second);
}

[[noreturn]] void throw_unknown(std::string_view name, const char* others) {
  throw InputError(
      fmt::format("there is no look '{}'; give {}{}", name, fmt::join(look_names(), ", "), others));
}

/// The names of settings that may stand in a look.
std::vector<std::string> keys() {
  std::vector<std::string> names{"description"};
  for (const PictureSetting& setting : picture_settings()) {
    if (setting.is_of_look) names.push_back(setting.name);
  }
  return names;
}

std::vector<std::string> palette_words(const toml::node& node) {
  std::vector<std::string> words;
  if (const toml::array* const list = node.as_array()) {
    for (const toml::node& word : *list) words.push_back(word.value<std::string>().value_or(""));
  } else {
    words.push_back(node.value<std::string>().value_or(""));
  }
  return words;
}

/// Sets one key's value.
void apply(PictureOptions& options, std::string_view key, const toml::node& node) {
  if (key == "description") return;
  const std::vector<std::string> known = keys();
  if (std::ranges::find(known, key) == known.end()) {
    throw InputError(fmt::format("it is not known here; a look has {}", fmt::join(known, ", ")));
  }
  const PictureSetting& setting = picture_setting_named(key);
  if (key == "palette") {
    options.palette = palette_from(palette_words(node), options.material);
  } else {
    base::read_value(node, setting, setting.place(options));
  }
}

/// A file that is named in a look's file is looked for beside it.
void find_environment(PictureOptions& options, const std::filesystem::path& folder) {
  std::string& environment = options.light.environment;
  if (environment.empty() || std::ranges::count(environment_names(), environment) > 0) return;
  environment = (folder / environment).string();
}

/// @param source of the text, for messages.
void apply_text(PictureOptions& options, std::string_view text, const std::string& source) {
  const toml::table table = base::parse_toml(text, source);
  const auto apply_key = [&](std::string_view key, const toml::node& node) {
    try {
      apply(options, key, node);
    } catch (const OptionError& error) {
      throw InputError(
          fmt::format("{}:{}: {}: {}", source, node.source().begin.line, key, error.problem()));
    } catch (const InputError& error) {
      throw InputError(
          fmt::format("{}:{}: {}: {}", source, node.source().begin.line, key, error.what()));
    }
  };
  // A palette depends on the material.
  if (const toml::node* const material = table.get("material")) apply_key("material", *material);
  for (auto&& [key, node] : table) {
    if (key.str() != "material") apply_key(key.str(), node);
  }
}

}  // namespace

std::vector<std::string> look_names() {
  std::vector<std::string> names;
  for (const auto& [path, text] : picture::embedded_looks()) {
    names.push_back(
        path.substr(kLooksFolder.size(), path.size() - kLooksFolder.size() - kLookEnding.size()));
  }
  std::ranges::sort(names);
  return names;
}

std::string look_description(std::string_view name) {
  const auto text = look_text(name);
  if (!text) throw_unknown(name, "");
  const toml::table table = base::parse_toml(*text, std::string(name));
  return table["description"].value_or<std::string>("");
}

void apply_built_in_look(PictureOptions& options, std::string_view name) {
  const auto text = look_text(name);
  if (!text) throw_unknown(name, "");
  PictureOptions changed = options;
  apply_text(changed, *text, fmt::format("the look {}", name));
  changed.look = name;
  options = std::move(changed);
}

void apply_look(PictureOptions& options, const std::string& look) {
  if (!look.ends_with(kLookEnding)) {
    if (!look_text(look)) throw_unknown(look, ", or a file that ends in .toml");
    apply_built_in_look(options, look);
    return;
  }
  constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 20;
  PictureOptions changed = options;
  changed.light.environment.clear();
  apply_text(changed, base::read_text_file(look, "look", kLargestFile, {}), look);
  find_environment(changed, std::filesystem::path(look).parent_path());
  if (changed.light.environment.empty()) changed.light.environment = options.light.environment;
  changed.look = look;
  options = std::move(changed);
}

}  // namespace qjulia
