# find_package(qjulia) gives qjulia::qjulia.
include(CMakeFindDependencyMacro)
foreach(dependency Eigen3 nlohmann_json OpenCL OpenMesh PNG ZLIB fmt Threads)
  find_dependency(${dependency})
endforeach()
find_dependency(PkgConfig)
pkg_check_modules(cairo REQUIRED IMPORTED_TARGET cairo)
include(${CMAKE_CURRENT_LIST_DIR}/qjulia_targets.cmake)
