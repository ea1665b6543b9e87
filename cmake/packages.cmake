# cmake --build … --target package: packages for Debian, in BUILD/packages. Each is a component of
# cmake/install.cmake; the Python package is one where it is built.
set(package_maintainer "qjulia developers <qjulia@example.org>")

set(package_of_command qjulia)
set(package_of_field_runtime libqjulia-field${PROJECT_VERSION_MAJOR})
set(package_of_field_dev libqjulia-field-dev)
set(package_of_runtime libqjulia${PROJECT_VERSION_MAJOR})
set(package_of_dev libqjulia-dev)
set(package_of_doc qjulia-doc)
set(components command field_runtime field_dev runtime dev doc)
if(TARGET qjulia_python)
  set(package_of_python python3-qjulia)
  list(APPEND components python)
endif()

# What every package of Debian holds.
set(texts ${PROJECT_BINARY_DIR}/packaging)
configure_file(packaging/debian/changelog.in ${texts}/changelog.Debian @ONLY)
execute_process(COMMAND ${GZIP} -9nf ${texts}/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)
foreach(component IN LISTS components)
  install(FILES ${PROJECT_SOURCE_DIR}/packaging/debian/copyright ${texts}/changelog.Debian.gz
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package_of_${component}} COMPONENT ${component}
          EXCLUDE_FROM_ALL)
endforeach()

function(describe_package component section summary text)
  string(TOUPPER ${component} name)
  set(CPACK_DEBIAN_${name}_PACKAGE_NAME ${package_of_${component}} PARENT_SCOPE)
  set(CPACK_DEBIAN_${name}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_DEBIAN_${name}_DESCRIPTION "${summary}\n${text}" PARENT_SCOPE)
endfunction()
set(about "qjulia finds iterated quaternion rational maps whose filled Julia sets\n\
have the shape of a given triangle mesh. It computes on CPUs and GPUs\n\
with OpenCL.\n\n")
describe_package(command graphics "program that fits iterated quaternion rational maps to shapes"
  "${about}This package has the command, which makes maps, and of maps surfaces,\npictures and pages.")
describe_package(field_runtime libs "library that evaluates quaternion rational maps"
  "${about}This package has the shared library that evaluates maps.")
describe_package(field_dev libdevel "library that evaluates quaternion rational maps (development)"
  "${about}This package has headers, a static library, and files for CMake and pkg-config\n\
for programs that evaluate maps.")
describe_package(runtime libs "library that fits quaternion rational maps to shapes"
  "${about}This package has the shared libraries for meshes, fits and pictures.")
describe_package(dev libdevel "library that fits quaternion rational maps to shapes (development)"
  "${about}This package has headers and static libraries for meshes, fits and pictures,\nfiles for CMake and \
pkg-config, and examples.")
describe_package(doc doc "documentation of qjulia, which fits quaternion maps to shapes"
  "${about}This package has the documentation, with pictures, some maps, and examples in\nPython.")
describe_package(python python "library that fits quaternion rational maps to shapes (Python)"
  "${about}This package has the module for Python 3.")

set(exactly "(= ${PROJECT_VERSION}-1)")
set(CPACK_DEBIAN_COMMAND_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")
set(CPACK_DEBIAN_COMMAND_PACKAGE_SUGGESTS "qjulia-doc, xdg-utils, blender (>= 3.4)")
set(CPACK_DEBIAN_FIELD_RUNTIME_PACKAGE_RECOMMENDS "pocl-opencl-icd | opencl-icd")
set(CPACK_DEBIAN_FIELD_DEV_PACKAGE_DEPENDS "${package_of_field_runtime} ${exactly}, \
libeigen3-dev (>= 3.4), nlohmann-json3-dev, ocl-icd-opencl-dev, zlib1g-dev, libfmt-dev")
set(CPACK_DEBIAN_FIELD_DEV_PACKAGE_SUGGESTS "qjulia-doc")
# The parts call each other's inner functions, so that all are of one version.
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS "${package_of_field_runtime} ${exactly}")
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "${package_of_runtime} ${exactly}, \
${package_of_field_dev} ${exactly}, libopenmesh-dev, libexpat1-dev, libpng-dev, libopenexr-dev, libcairo2-dev, \
pkgconf")
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "qjulia-doc, liblbfgspp-dev")
set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
if(TARGET qjulia_python)
  math(EXPR next "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-matplotlib, python3-pyopencl")
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME qjulia)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
set(CPACK_PACKAGE_CONTACT "${package_maintainer}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_COMPONENTS_ALL ${components})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SOURCE qjulia)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/host)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")
foreach(component FIELD_RUNTIME RUNTIME)
  set(CPACK_DEBIAN_${component}_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/debian/triggers)
endforeach()
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/packaging/debian/finish.cmake)
include(CPack)
