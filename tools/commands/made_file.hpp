#pragma once
/// Files that pages of `qjulia explore` ask for, made by the commands that make them otherwise.

#include <string>

#include "explore/request.hpp"
#include "jobs/job_run.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::tools {

/// A map as files call it that are made of it.
struct NamedMap {
  std::string name;    ///< of its file, without folders
  std::string hash{};  ///< of that file's bytes; empty: not known
};

/// @return the file's bytes. @param monitor gets, at last, what the file holds.
/// @throws what `surface` and `render` do
std::string made_file(const NamedMap& source, const Device& device, const Map& map,
                      const explore::MakeRequest& wanted, const ProgressMonitor& monitor);

}  // namespace qjulia::tools
