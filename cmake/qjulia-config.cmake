# find_package(qjulia) gives all of the library:
#   qjulia::field         evaluates maps; it needs none of OpenMesh, Expat, PNG, OpenEXR and cairo
#   qjulia::mesh          meshes of maps, and exact maps of meshes; it also needs OpenMesh and Expat
#   qjulia::fit           fits maps to meshes; it has the dependencies of qjulia::mesh
#   qjulia::picture       pictures; it needs OpenMesh, Expat, PNG, OpenEXR and cairo
#   qjulia::qjulia        all of these, and measurements of devices
#   qjulia::shared        all of it as a shared library; its parts are qjulia::NAME_shared
# With COMPONENTS, which are field, mesh, fit, picture, field_shared and shared, it gives these components
# and those that they are built on, and looks only for the dependencies of these.
include(CMakeFindDependencyMacro)
set(qjulia_parts field mesh fit picture all field_shared shared)
set(qjulia_with_field field)
set(qjulia_with_mesh field mesh)
set(qjulia_with_fit field mesh fit)
set(qjulia_with_picture field mesh picture)
set(qjulia_with_all ${qjulia_parts})
set(qjulia_with_field_shared field_shared)
set(qjulia_with_shared field_shared shared)

set(qjulia_components all)
if(qjulia_FIND_COMPONENTS)
  set(qjulia_components ${qjulia_FIND_COMPONENTS})
endif()
set(qjulia_wanted "")
foreach(qjulia_component IN LISTS qjulia_components)
  set(qjulia_problem "")
  if(NOT qjulia_component IN_LIST qjulia_parts)
    set(qjulia_problem "qjulia has no component '${qjulia_component}'; it has field, mesh, fit, picture, \
field_shared and shared")
  else()
    foreach(qjulia_part IN LISTS qjulia_with_${qjulia_component})
      if(NOT EXISTS ${CMAKE_CURRENT_LIST_DIR}/qjulia_${qjulia_part}_targets.cmake)
        set(qjulia_problem "qjulia's field alone is installed here, without the component \
'${qjulia_component}'; install the rest, which is Debian's libqjulia-dev")
      endif()
    endforeach()
  endif()
  if(NOT qjulia_problem)
    set(qjulia_${qjulia_component}_FOUND TRUE)
    list(APPEND qjulia_wanted ${qjulia_with_${qjulia_component}})
  elseif(qjulia_FIND_REQUIRED_${qjulia_component} OR NOT qjulia_FIND_COMPONENTS)
    set(qjulia_FOUND FALSE)
    set(qjulia_NOT_FOUND_MESSAGE "${qjulia_problem}")
    return()
  endif()
endforeach()

find_dependency(Eigen3)
find_dependency(nlohmann_json)
if("field" IN_LIST qjulia_wanted)
  find_dependency(OpenCL)
  find_dependency(ZLIB)
  find_dependency(fmt)
endif()
if("mesh" IN_LIST qjulia_wanted)
  find_dependency(OpenMesh)
  find_dependency(PkgConfig)  # which FindEXPAT calls without looking for it
  find_dependency(EXPAT)
  find_dependency(Threads)
endif()
if("picture" IN_LIST qjulia_wanted)
  find_dependency(PNG)
  find_dependency(OpenEXR)
  pkg_check_modules(cairo REQUIRED IMPORTED_TARGET cairo)
endif()
foreach(qjulia_part IN LISTS qjulia_parts)  # those that others are built on come first
  if(qjulia_part IN_LIST qjulia_wanted)
    include(${CMAKE_CURRENT_LIST_DIR}/qjulia_${qjulia_part}_targets.cmake)
  endif()
endforeach()
