# find_package(qjulia) gives
#   qjulia::qjulia        all of the library, static
#   qjulia::field         what evaluates maps, static; it needs none of OpenMesh, Expat, PNG and cairo
#   qjulia::shared        all of the library, shared
#   qjulia::field_shared  what evaluates maps, shared
# With COMPONENTS field it gives qjulia::field alone, with COMPONENTS shared the shared ones alone, with
# both these three, and asks for no library that they do not need.
include(CMakeFindDependencyMacro)
set(qjulia_wanted all)
if(qjulia_FIND_COMPONENTS)
  set(qjulia_wanted ${qjulia_FIND_COMPONENTS})
endif()
foreach(qjulia_component IN LISTS qjulia_wanted)
  if(qjulia_component MATCHES "^(all|field|shared)$")
    set(qjulia_${qjulia_component}_FOUND TRUE)
  elseif(qjulia_FIND_REQUIRED_${qjulia_component})
    set(qjulia_FOUND FALSE)
    set(qjulia_NOT_FOUND_MESSAGE "qjulia has no component '${qjulia_component}'; it has field and shared")
    return()
  endif()
endforeach()

find_dependency(Eigen3)
find_dependency(nlohmann_json)
if(NOT qjulia_wanted STREQUAL "shared")
  find_dependency(OpenCL)
  find_dependency(ZLIB)
  find_dependency(fmt)
  include(${CMAKE_CURRENT_LIST_DIR}/qjulia_field_targets.cmake)
endif()
if(qjulia_wanted STREQUAL "all")
  find_dependency(OpenMesh)
  find_dependency(EXPAT)
  find_dependency(PNG)
  find_dependency(Threads)
  find_dependency(PkgConfig)
  pkg_check_modules(cairo REQUIRED IMPORTED_TARGET cairo)
  include(${CMAKE_CURRENT_LIST_DIR}/qjulia_targets.cmake)
endif()
if(NOT qjulia_wanted STREQUAL "field")
  include(${CMAKE_CURRENT_LIST_DIR}/qjulia_shared_targets.cmake)
endif()
