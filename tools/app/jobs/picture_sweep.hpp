#pragma once
/// Pictures for several values of one option: sweeps and turntables.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "describe/command_line.hpp"
#include "describe/view_options.hpp"

namespace qjulia::tools {

/// One option taken through a list of values: a picture for each.
struct Sweep {
  std::string name;  ///< the option's, without dashes
  std::vector<double> values;

  /// A view for each value. @param base what holds for all of them.
  std::vector<View> views(const View& base) const;
};

/// What a user asks for: --sweep or --turntable.
struct SweepChoice {
  std::optional<std::string> sweep;
  std::optional<int> turntable;
};

/// What can be swept, for help and errors.
std::string sweep_names();

/// The sweep with all its values checked; none where none is asked for.
/// @param base what holds for all pictures. @param camera the camera's options.
/// @throws InputError where a value cannot be used, where the option has a value of its own too, or
///   where `input` is a mesh and the option a map's.
std::optional<Sweep> wanted_sweep(const SweepChoice& wanted, const std::string& input,
                                  const View& base, const std::vector<Option>& camera);

/// The job of one picture of a sweep.
/// @param job of the sweep. @param asked what holds for all its pictures. @param drawn what this
/// one was drawn with.
Job frame_job(Job job, const View& asked, const View& drawn);

/// "sheet.png" and 7: "sheet_007.png".
std::filesystem::path frame_path(const std::filesystem::path& sheet, std::size_t number);

/// One row of up to five pictures; else nearly as many rows as columns, with few cells empty.
int sheet_columns(int count);

/// How many times narrower and lower pictures are on a sheet than alone, since the sheet is made in
/// memory and a .png has its limits.
int sheet_reduction(const PictureOptions& options, std::size_t count);

}  // namespace qjulia::tools
