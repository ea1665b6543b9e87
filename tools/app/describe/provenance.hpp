#pragma once
/// Where a map, a mesh or a picture came from, as its file or report tells.

#include <filesystem>
#include <nlohmann/json.hpp>

#include "describe/job.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::tools {

/// Every option of a fit by its name; null, or the word "auto", where it is not given.
nlohmann::json to_json(const FitOptions& options);

/// What a fit is of. It is taken before the mesh is read, since files may change during the fit.
struct FitOrigin {
  Job job;
  nlohmann::json mesh, options;
  Precision precision = Precision::single;
};

/// The job of `fit` that has these options. @param initial the file of `FitOptions::initial`;
/// empty: there is none. @throws InputError when the mesh cannot be read.
Job fit_job(const std::filesystem::path& mesh_path, const FitOptions& options,
            const std::filesystem::path& initial = {});

/// @param job of the fit, with the hashes of its inputs. @throws InputError when the schedule
/// cannot be read.
FitOrigin origin_of(const FitOptions& options, Job job);

/// The job, program, mesh (name and hash), options, device, stages, figures and times. Times differ
/// from run to run; nothing else does.
nlohmann::json provenance(const FitOrigin& origin, const Device& device, const FitResult& result);

/// Without what differs from run to run, for files that are to be the same bytes whenever they are
/// made.
nlohmann::json without_times(nlohmann::json provenance);

/// A fit by what its map's provenance tells. @param file for messages.
/// @throws InputError when it does not tell.
FitResult finished_fit(Map map, const std::filesystem::path& file);

/// "qjulia 0.1.0".
std::string program_name();

nlohmann::json device_json(const DeviceInfo& device);

/// What a file says of how it was made: the job.
nlohmann::json made_with(const Job& job);

/// On one line in ASCII, for the text of files, comments of XML too. File names may hold any bytes.
std::string one_line(const nlohmann::json& json);

/// A .png whose text chunks say which program made it, and `how`. @param map what it holds of a
/// map, as `packed_map` makes it. @throws OutputError
void write_picture(const Image& image, const std::filesystem::path& path, const nlohmann::json& how,
                   const std::string& map = {});

/// An .exr of all layers, with the same in its header. @throws OutputError
void write_layered_picture(const LayeredImage& picture, const std::filesystem::path& path,
                           const nlohmann::json& how);

/// What a map says of how its shape stands, for people. @param chosen empty: it was guessed
std::string up_line(UpAxis up, const std::optional<UpAxis>& chosen);

/// Every setting of a picture by its name. A clay picture's `palette` is its one colour.
nlohmann::json to_json(const PictureOptions& options);

/// Energy, IoU and mean distance of the map that a fit ended with; the first two are null where it
/// had no stage.
nlohmann::json final_figures(const FitResult& result);

}  // namespace qjulia::tools
