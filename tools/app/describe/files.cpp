#include "describe/files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/file_types.hpp"
#include "base/fnv_hash.hpp"
#include "base/input_file.hpp"
#include "base/text.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"

namespace qjulia::tools {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

}  // namespace

bool is_mesh_file(const std::filesystem::path& path) {
  if (!base::has_type(path, base::FileContent::mesh, base::FileUse::read)) return false;
  // What comes through a pipe cannot be looked at first.
  std::error_code ignored;
  return !std::filesystem::is_regular_file(path, ignored) || !holds_map(path);
}

void expect_map(const std::string& option, const std::filesystem::path& path) {
  if (!is_mesh_file(path)) return;
  throw InputError(fmt::format("{} needs a map, and '{}' is a mesh", option, path.string()));
}

std::string shell_word(const std::string& name) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./+,:@%=";
  std::string word = name.starts_with('-') ? "./" + name : name;
  if (word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::string shell_words(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    const std::size_t dashes = std::min(word.find_first_not_of('-'), word.size());
    text += (text.empty() ? "" : " ") + word.substr(0, dashes) + shell_word(word.substr(dashes));
  }
  return text;
}

std::string name_of(const std::filesystem::path& path) {
  return base::to_utf8(path.filename().string());
}

void check_map_name(const std::filesystem::path& path) {
  const auto content = base::content_of(path);
  if (!content || *content == base::FileContent::map) return;
  throw InputError(fmt::format("--output: '{}' has the name of a {}; end it in .qjulia.json",
                               path.string(), to_string(*content)));
}

std::vector<std::string> readable(std::initializer_list<base::FileContent> contents) {
  std::vector<std::string> all;
  for (const base::FileContent content : contents) {
    for (std::string& extension : base::extensions(content, base::FileUse::read)) {
      if (std::ranges::find(all, extension) == all.end()) all.push_back(std::move(extension));
    }
  }
  return all;
}

std::string named_after(const std::string& input, const std::string& extension) {
  std::filesystem::path stem = std::filesystem::path(input).filename().stem();
  if (base::extension_of(stem) == ".qjulia") stem = stem.stem();
  return stem.string() + extension;
}

base::Output output_named(const std::string& option, const OutputName& name,
                          std::vector<std::string> extensions) {
  return {option, name.path, std::move(extensions), false, name.must_be_new};
}

nlohmann::json read_report(const std::string& path, const std::string& what) {
  constexpr std::uint64_t kLargestFile = std::uint64_t{16} << 20;
  const std::string text = base::read_text_file(path, "report", kLargestFile);
  auto json = base::is_json_too_deep(text) ? nlohmann::json(nlohmann::json::value_t::discarded)
                                           : nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) {
    throw InputError(fmt::format("{} '{}' is not JSON; make it with --json", what, path));
  }
  return json;
}

std::string file_hash(const std::filesystem::path& path) {
  constexpr std::uint64_t kBlock = std::uint64_t{1} << 20;
  base::InputFile file(path, "file", kNoLimit);
  base::FnvHash hash;
  std::string block;
  do {
    block.clear();
    file.read(block, kBlock);
    hash.add(block);
  } while (!block.empty());
  return hash.text();
}

std::string text_hash(std::string_view text) {
  base::FnvHash hash;
  hash.add(text);
  return hash.text();
}

}  // namespace qjulia::tools
