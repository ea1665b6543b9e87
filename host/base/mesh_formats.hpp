#pragma once
/// The list of mesh formats: FORMAT(name, extension, uses) for each, in the order of lists for
/// people. `uses` combines the flags of host/base/file_types.cpp; `shape::obj_format()`, and so on
/// for each name, says how files of the format are recognised, read and written.

#define QJULIA_MESH_FORMATS(FORMAT)                        \
  FORMAT(obj, ".obj", kRead | kWrite | kPaint | kNote)     \
  FORMAT(off, ".off", kRead | kWrite)                      \
  FORMAT(ply, ".ply", kRead | kWrite | kPaint | kNote)     \
  FORMAT(stl, ".stl", kRead | kWrite | kPrint)             \
  FORMAT(glb, ".glb", kRead | kWrite | kNote)              \
  FORMAT(gltf, ".gltf", kRead)                             \
  FORMAT(threemf, ".3mf", kRead | kWrite | kPrint | kNote) \
  FORMAT(usda, ".usda", kWrite | kNote)
