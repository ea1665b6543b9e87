#pragma once
/// All of the library.

#include "qjulia/batch.hpp"
#include "qjulia/compare.hpp"
#include "qjulia/detail.hpp"
#include "qjulia/device.hpp"
#include "qjulia/error.hpp"
#include "qjulia/field.hpp"
#include "qjulia/fit.hpp"
#include "qjulia/knobs.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/rational_map.hpp"
#include "qjulia/sample.hpp"
#include "qjulia/shape.hpp"
#include "qjulia/surface.hpp"
#include "qjulia/version.hpp"
