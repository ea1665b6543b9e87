#pragma once
/// Point caches: the frames of a mesh that moves, in one file.

#include <cstddef>
#include <filesystem>
#include <stop_token>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

// A point cache is a .npz file, as `numpy.savez` and `numpy.savez_compressed` write it, with the
// arrays `vertices`, frames × vertices × 3 of float32 or float64, and `faces`, triangles × 3 of
// whole numbers from 0 on. Both are in C order and little-endian. Other arrays are ignored.
//
// All functions throw InputError that names the file and the array: missing, damaged, of another
// type or shape, more than 2³¹ − 1 vertices or triangles, an index out of range, a coordinate that
// is not finite. Memory grows with one frame and with the file, whatever its headers promise.

/// Whether the file's name is that of a point cache.
bool is_point_cache(const std::filesystem::path& path);

/// How many frames the file has, whose faces are checked.
std::size_t count_frames(const std::filesystem::path& path, std::stop_token stop = {});

/// A frame as the file has it. @param frame from 0 on. @throws InputError where there is none
TriangleMesh read_frame(const std::filesystem::path& path, std::size_t frame,
                        std::stop_token stop = {});

/// A frame as `read_and_inspect_mesh` reads it from a file with these numbers.
InspectedMesh read_and_inspect_frame(const std::filesystem::path& path, std::size_t frame,
                                     std::stop_token stop = {});

}  // namespace qjulia
