#pragma once
/// What pictures and coloured meshes have in common.

#include "keywords.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::python {

/// A palette by its name, or colours: one for clay, several for other materials. The material is
/// read before.
void take_palette(Keywords& keywords, PictureOptions& options);

}  // namespace qjulia::python
