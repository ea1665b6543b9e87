#include "map/shell_settings.hpp"

#include "qjulia/map/detail.hpp"

namespace qjulia::map {

Setting detail_setting() {
  return {.name = "detail",
          .values = "WORD|FRACTION",
          .unit = "of the box's diagonal",
          .least = kLeastDetail,
          .most = kMostDetail,
          .example = "0.03",
          .help =
              "Thickness of the fractal shell: 'auto' gives the set a roughness of about 1.2 "
              "on a grid of 256 cells, by how unevenly the shape's radii are spread; 'smooth' "
              "is an eighth of it, 'clear' half, 'wild' twice as much. Or a number, the "
              "fraction of the shape's box diagonal, from 0.0001 to 0.1: at 0.02 a round body "
              "is clearly grooved, at 0.01 a thin figure (in an exact map at half of that)",
          .more = "It can be changed later.",
          .interpolation = Interpolation::logarithmic};
}

Setting steepness_setting() {
  return {.name = "steepness",
          .values = "NUMBER",
          .least = 1,
          .most = kMostSteepness,
          .example = "2",
          .help =
              "How many times as steep the field is outside the shape, 1 to 100: above 1 tufts "
              "that stand off the shape are shorter, and fewer pieces come loose",
          .more = "It can be changed later.",
          .interpolation = Interpolation::logarithmic};
}

Setting up_setting() {
  return {.name = "up",
          .values = "x|y|z|-x|-y|-z|auto",
          .automatic = "auto",
          .example = "z",
          .help =
              "The mesh's axis that points up in pictures, and in files that have an up of "
              "their own. auto: the mesh's flattest, widest end is down; where none is, z is "
              "up in .stl and .3mf files and y in others",
          .interpolation = Interpolation::none};
}

}  // namespace qjulia::map
