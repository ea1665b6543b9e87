#pragma once
/// The meshes an entry of a manifest stands for, and what their fits are called.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace qjulia::batch {

/// Whether the path has one of the characters * ? [ and so may stand for several files.
bool is_glob(const std::string& path);

/// Mesh files (by extension) that match, sorted; relative patterns begin at `folder`.
std::vector<std::filesystem::path> find_meshes(const std::filesystem::path& folder,
                                               const std::string& pattern);

/// What a fit of `mesh` is called: `name` with its asterisk replaced by the mesh's name without
/// extension; without a name, that.
std::string entry_name(const std::optional<std::string>& name, const std::filesystem::path& mesh);

/// Why files cannot be called so; empty when they can.
std::string name_problem(const std::string& name);

}  // namespace qjulia::batch
