#pragma once
/// qjulia profile --tune, --grid, --export and --import: settings of a device.

#include <string>
#include <vector>

#include "qjulia/tune.hpp"
#include "session.hpp"

namespace qjulia::tools {

/// "lane_width=1,8,16" added to `grid`. @throws InputError
void add_to_grid(const std::string& text, TuneGrid& grid);

int run_tune(const TrustedDevice& device, const ProfileOptions& options, Session& session);
/// @param csv file to write too; empty: none.
int run_grid(const TrustedDevice& device, const ProfileOptions& options, const TuneGrid& grid,
             const std::string& csv, Session& session);
int run_export(const TrustedDevice& device, const std::string& file, Session& session);
int run_import(const TrustedDevice& device, const std::string& file, Session& session);

}  // namespace qjulia::tools
