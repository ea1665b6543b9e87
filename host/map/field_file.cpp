#include <fmt/format.h>

#include <bit>
#include <string>
#include <vector>

#include "base/file_types.hpp"
#include "base/npy.hpp"
#include "base/output_file.hpp"
#include "qjulia/map/sample.hpp"

namespace qjulia {
namespace {

static_assert(std::endian::native == std::endian::little, "the files say so");

/// Text that may stand in an XML comment: no two hyphens in a row.
std::string for_comment(std::string text) {
  for (std::size_t at = 0; (at = text.find("--", at)) != std::string::npos;) {
    text.insert(++at, 1, ' ');
  }
  return text.ends_with('-') ? text + ' ' : text;
}

/// The VTK file formats, "ImageData", appended raw data: a count of bytes, then the values.
std::string vti_header(const CellGrid& grid, Precision precision, const std::string& comment) {
  const Eigen::Vector3d origin = grid.center(0, 0, 0);
  const Eigen::Vector3d step = grid.cell();
  const std::string extent =
      fmt::format("0 {} 0 {} 0 {}", grid.cells[0] - 1, grid.cells[1] - 1, grid.cells[2] - 1);
  const std::string type = precision == Precision::dbl ? "Float64" : "Float32";
  std::string header = "<?xml version=\"1.0\"?>\n";
  if (!comment.empty()) header += fmt::format("<!-- {} -->\n", for_comment(comment));
  header += fmt::format(
      "<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n"
      "<ImageData WholeExtent=\"{0}\" Origin=\"{1} {2} {3}\" Spacing=\"{4} {5} {6}\">\n"
      "<Piece Extent=\"{0}\">\n"
      "<PointData Scalars=\"F\"><DataArray type=\"{7}\" Name=\"F\" format=\"appended\" "
      "offset=\"0\"/></PointData>\n"
      "</Piece>\n</ImageData>\n<AppendedData encoding=\"raw\">\n_",
      extent, origin.x(), origin.y(), origin.z(), step.x(), step.y(), step.z(), type);
  const std::uint64_t bytes = grid.size() * (precision == Precision::dbl ? 8 : 4);
  header.append(reinterpret_cast<const char*>(&bytes), sizeof bytes);
  return header;
}

template <class Real>
void put(std::ostream& stream, std::span<const double> values) {
  const std::vector<Real> reals(values.begin(), values.end());
  stream.write(reinterpret_cast<const char*>(reals.data()),
               static_cast<std::streamsize>(reals.size() * sizeof(Real)));
}

}  // namespace

CellGrid write_field(const Device& device, const Map& map, const SampleOptions& options,
                     const std::filesystem::path& path, const std::string& comment,
                     const ProgressMonitor& monitor) {
  const bool npy =
      base::expect_type(path, base::FileContent::field, base::FileUse::write) == ".npy";
  CellGrid grid = sample_grid(device, map, options, monitor.stop);
  base::OutputFile file(path);
  std::ostream& stream = file.stream();
  if (npy) {
    const std::vector<std::size_t> shape(grid.cells.begin(), grid.cells.end());
    stream << base::npy_header(shape, options.precision == Precision::dbl);
  } else {
    stream << vti_header(grid, options.precision, comment);
  }
  sample_field(
      device, map, options, grid, npy ? CellOrder::z_fastest : CellOrder::x_fastest,
      [&](std::span<const double> values) {
        options.precision == Precision::dbl ? put<double>(stream, values)
                                            : put<float>(stream, values);
        // A full disk ends the work now, not when all has been computed.
        if (!stream.flush()) file.commit();
      },
      monitor);
  if (!npy) stream << "\n</AppendedData>\n</VTKFile>\n";
  file.commit();
  return grid;
}

}  // namespace qjulia
