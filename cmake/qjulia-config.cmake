# find_package(qjulia) gives qjulia::qjulia, all of the library, and qjulia::field, which evaluates
# maps and needs none of OpenMesh, PNG and cairo. find_package(qjulia COMPONENTS field) asks for the
# latter's libraries alone, and gives only it.
include(CMakeFindDependencyMacro)
foreach(dependency Eigen3 nlohmann_json OpenCL ZLIB fmt)
  find_dependency(${dependency})
endforeach()
include(${CMAKE_CURRENT_LIST_DIR}/qjulia_field_targets.cmake)
if(NOT "${qjulia_FIND_COMPONENTS}" STREQUAL "field")
  find_dependency(OpenMesh)
  find_dependency(PNG)
  find_dependency(Threads)
  find_dependency(PkgConfig)
  pkg_check_modules(cairo REQUIRED IMPORTED_TARGET cairo)
  include(${CMAKE_CURRENT_LIST_DIR}/qjulia_targets.cmake)
endif()
