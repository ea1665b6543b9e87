#pragma once
/// What is around a set on all sides, as a picture: read, cut into lights, and blurred for
/// reflections.

#include <Eigen/Core>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

namespace qjulia::picture {

/// Radiance from all directions; 1 is that of white in even light of irradiance π. Rows go from
/// overhead to below. In axes right, up, back the texel at the share u of a row and v of a column
/// lies in the direction (sin p sin t, cos t, −cos p sin t), p = 2 π (u − ½), t = π v.
struct Environment {
  int width = 0, height = 0;
  std::vector<Eigen::Vector3f> radiance;

  static Eigen::Vector3d direction(double u, double v);
  Eigen::Vector3d towards(int column, int row) const {
    return direction((column + 0.5) / width, (row + 0.5) / height);
  }
  double steradians(int row) const;  ///< of each of its texels
  const Eigen::Vector3f& at(int column, int row) const {
    return radiance[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                    static_cast<std::size_t>(column)];
  }
  /// As wide as this, with means of texels or with each several times.
  Environment of_width(int columns) const;
  Environment reduced(int most_wide) const {
    return width > most_wide ? of_width(most_wide) : *this;
  }
};

/// Whether the text is a built-in environment's name, or a file's that may hold one.
/// @throws OptionError naming `environment` otherwise.
void expect_environment(const std::string& name_or_file);

/// A built-in environment, or a file's: .hdr (Radiance) or .exr (OpenEXR).
/// @throws InputError naming the file and what is wrong with it.
Environment read_environment(const std::string& name_or_file, const std::stop_token& stop);

/// The same of the bytes of a file. @throws InputError saying what is wrong.
Environment environment_from_hdr(std::string_view bytes);
Environment environment_from_exr(std::string_view bytes);

/// A part of an environment as a light.
struct Cone {
  Eigen::Vector3d towards;  ///< unit, in its axes
  Eigen::Vector3d color;    ///< irradiance of a surface that faces it, by π
  double steradians = 0;
};

/// An environment that lights a set.
struct EnvironmentLight {
  Environment whole;
  Environment sky;          ///< without the sun
  std::optional<Cone> sun;  ///< what is small, and sends at least a ninth of all light
};
EnvironmentLight light_of(Environment whole);

/// So many parts at most, of about equal light where they are equally large. The next part to be
/// halved is the one with the greatest product of light and extent, across its longer side where
/// the halves send most nearly the same (Debevec 2005, "A median cut algorithm for light probe
/// sampling"). Parts that send nothing are left out.
std::vector<Cone> cones_of(const Environment& sky, int count);

/// The maps that kernels take (layout/picture_layout.h), times `color`.
struct EnvironmentMaps {
  int width = 0, height = 0;  ///< of the first two
  std::vector<float> texels;
};
EnvironmentMaps environment_maps(const EnvironmentLight& light, const Eigen::Vector3d& color);

}  // namespace qjulia::picture
