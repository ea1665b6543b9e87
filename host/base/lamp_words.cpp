#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/range_check.hpp"
#include "base/text.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/lamp.hpp"

namespace qjulia {
namespace {

constexpr const char* kColorHelp = "RRGGBB (sRGB, such as ff8000), white or black";

/// The chromaticity of a black body (Kim et al. 2002), as linear sRGB of luminance 1.
Eigen::Vector3d black_body(double kelvin) {
  const double t = 1000 / kelvin;
  const auto cubic = [](double u, double a, double b, double c, double d) {
    return ((a * u + b) * u + c) * u + d;
  };
  const double x = kelvin <= 4000 ? cubic(t, -0.2661239, -0.2343589, 0.8776956, 0.179910)
                                  : cubic(t, -3.0258469, 2.1070379, 0.2226347, 0.240390);
  double y = 0;
  if (kelvin <= 2222) {
    y = cubic(x, -1.1063814, -1.34811020, 2.18555832, -0.20219683);
  } else if (kelvin <= 4000) {
    y = cubic(x, -0.9549476, -1.37418593, 2.09137015, -0.16748867);
  } else {
    y = cubic(x, 3.0817580, -5.87338670, 3.75112997, -0.37001483);
  }
  Eigen::Matrix3d to_rgb;                       // IEC 61966-2-1
  to_rgb << 3.2404542, -1.5371385, -0.4985314,  //
      -0.9692660, 1.8760108, 0.0415560,         //
      0.0556434, -0.2040259, 1.0572252;
  return (to_rgb * Eigen::Vector3d(x / y, 1, (1 - x - y) / y)).cwiseMax(0);
}

double number_of(const std::string& word, const char* what) {
  const auto value = base::number_in<double>(word);
  if (value && std::isfinite(*value)) return *value;
  throw InputError(
      fmt::format("'{}' is no {}; a lamp is AZIMUTH,ELEVATION,STRENGTH, and may go on "
                  "with ,COLOUR,SIZE, such as -60,40,1.2,3200K,5",
                  word, what));
}

}  // namespace

void LightColor::validate(const char* field) const {
  if (kelvin) {
    base::expect_between(field, *kelvin, kLeastKelvin, kMostKelvin, "kelvin");
  } else if (!(rgb.array() >= 0 && rgb.array() <= 1).all()) {
    throw OptionError(field, "a colour's parts are 0 to 1");
  }
}

Rgb LightColor::linear() const {
  if (!kelvin) return rgb;
  constexpr double kWhite = 6500;
  const Rgb color = black_body(*kelvin).cwiseQuotient(black_body(kWhite));
  return color / color.maxCoeff();
}

LightColor light_color_from(std::string_view text) {
  if (text.ends_with('K')) {
    const auto kelvin = base::number_in<double>(text.substr(0, text.size() - 1));
    if (kelvin && *kelvin >= LightColor::kLeastKelvin && *kelvin <= LightColor::kMostKelvin) {
      return {kelvin, Rgb::Ones()};
    }
    throw InputError(fmt::format("'{}' is no temperature of light; give {}K to {}K", text,
                                 LightColor::kLeastKelvin, LightColor::kMostKelvin));
  }
  if (const auto color = color_named(text)) return {std::nullopt, *color};
  throw InputError(fmt::format(
      "'{}' is no colour of light; give a temperature such as 3200K, or {}", text, kColorHelp));
}

std::string to_string(const LightColor& color) {
  return color.kelvin ? fmt::format("{}K", *color.kelvin) : color_name(color.rgb);
}

void Lamp::validate() const {
  base::expect_finite("lamp", azimuth);
  base::expect_between("lamp", elevation, -90.0, 90.0, "degrees of elevation");
  base::expect_between("lamp", strength, 0.0, kMostStrength, "of strength");
  base::expect_between("lamp", size, 0.0, kMostSize, "degrees of size");
  color.validate("lamp");
}

Lamp lamp_from(std::string_view text) {
  const std::vector<std::string> words = base::split(text, ',');
  if (words.size() < 3 || words.size() > 5) {
    throw InputError(
        fmt::format("'{}' is no lamp; give AZIMUTH,ELEVATION,STRENGTH, and after these "
                    "COLOUR,SIZE if you like, such as -60,40,1.2,3200K,5",
                    text));
  }
  Lamp lamp{.azimuth = number_of(words[0], "azimuth"),
            .elevation = number_of(words[1], "elevation"),
            .strength = number_of(words[2], "strength")};
  if (words.size() > 3) lamp.color = light_color_from(words[3]);
  if (words.size() > 4) lamp.size = number_of(words[4], "size");
  return lamp;
}

std::string to_string(const Lamp& lamp) {
  return fmt::format("{},{},{},{},{}", lamp.azimuth, lamp.elevation, lamp.strength,
                     to_string(lamp.color), lamp.size);
}

Background background_from(std::string_view text) {
  if (text == "studio") return {};
  if (text == "transparent") return {Backdrop::transparent};
  if (text == "environment") return {Backdrop::environment};
  if (const auto color = color_named(text)) return {Backdrop::plain, *color};
  throw InputError(
      fmt::format("'{}' is no background; give studio, transparent, environment, or a colour: {}",
                  text, kColorHelp));
}

std::string to_string(const Background& background) {
  switch (background.kind) {
    case Backdrop::studio:
      return "studio";
    case Backdrop::plain:
      return color_name(background.color);
    case Backdrop::environment:
      return "environment";
    case Backdrop::transparent:
      break;
  }
  return "transparent";
}

}  // namespace qjulia
