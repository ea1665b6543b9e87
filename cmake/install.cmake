# cmake --install: the command with its manual pages and completions, the libraries, their headers, and
# what find_package(qjulia) and pkg-config read. Components are the packages of cmake/packages.cmake.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/qjulia)

install(TARGETS qjulia_command COMPONENT command)
install(DIRECTORY ${QJULIA_MANUAL}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT command
        FILES_MATCHING PATTERN *.1.gz)
set(completions ${CMAKE_INSTALL_DATADIR})
install(FILES ${QJULIA_MANUAL}/qjulia.bash DESTINATION ${completions}/bash-completion/completions
        RENAME qjulia COMPONENT command)
install(FILES ${QJULIA_MANUAL}/_qjulia DESTINATION ${completions}/zsh/vendor-completions COMPONENT command)
install(FILES ${QJULIA_MANUAL}/qjulia.fish DESTINATION ${completions}/fish/vendor_completions.d
        COMPONENT command)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/host/fit/schedules DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples
        COMPONENT command FILES_MATCHING PATTERN *.toml)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/schedules DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples
        COMPONENT command FILES_MATCHING PATTERN *.toml)
install(FILES ${QJULIA_ADDON} DESTINATION ${CMAKE_INSTALL_DATADIR}/qjulia/blender COMPONENT command)

# The field's part of the library has packages of its own, which need none of OpenMesh, Expat, PNG, OpenEXR and cairo.
install(TARGETS libqjulia_field EXPORT qjulia_field_targets ARCHIVE COMPONENT field_dev)
install(TARGETS libqjulia_field_shared EXPORT qjulia_field_shared_targets
        LIBRARY COMPONENT field_runtime NAMELINK_COMPONENT field_dev)
foreach(part mesh fit picture)
  install(TARGETS libqjulia_${part} EXPORT qjulia_${part}_targets ARCHIVE COMPONENT dev)
endforeach()
install(TARGETS qjulia EXPORT qjulia_all_targets ARCHIVE COMPONENT dev)
install(TARGETS libqjulia_mesh_shared libqjulia_fit_shared libqjulia_picture_shared qjulia_shared
        EXPORT qjulia_shared_targets LIBRARY COMPONENT runtime NAMELINK_COMPONENT dev)
foreach(part field field_shared)
  install(EXPORT qjulia_${part}_targets NAMESPACE qjulia:: DESTINATION ${package_folder} COMPONENT field_dev)
endforeach()
foreach(part mesh fit picture all shared)
  install(EXPORT qjulia_${part}_targets NAMESPACE qjulia:: DESTINATION ${package_folder} COMPONENT dev)
endforeach()

# Headers of the rooms of that part; they include no others (lint.headers builds each alone).
set(header_folder ${CMAKE_INSTALL_INCLUDEDIR}/qjulia)
foreach(room base device map energy)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/qjulia/${room} DESTINATION ${header_folder} COMPONENT field_dev)
endforeach()
foreach(room mesh exact surface morph fit edit picture profile check)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/qjulia/${room} DESTINATION ${header_folder} COMPONENT dev)
endforeach()
install(FILES ${PROJECT_SOURCE_DIR}/include/qjulia/qjulia.hpp DESTINATION ${header_folder} COMPONENT dev)

write_basic_package_version_file(${PROJECT_BINARY_DIR}/qjulia-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_SOURCE_DIR}/cmake/qjulia-config.cmake
              ${PROJECT_BINARY_DIR}/qjulia-config-version.cmake
        DESTINATION ${package_folder} COMPONENT field_dev)

# install_pkg_config(NAME COMPONENT LIBRARY DESCRIPTION [REQUIRES …] [PRIVATE …] [LIBS …]): NAME.pc of a
# library, which asks for REQUIRES, and when it is linked statically for PRIVATE and LIBS too.
function(install_pkg_config name component library description)
  cmake_parse_arguments(PC "" "" "REQUIRES;PRIVATE;LIBS" ${ARGN})
  file(RELATIVE_PATH to_prefix /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
  string(REGEX REPLACE "/$" "" to_prefix ${to_prefix})
  list(JOIN PC_REQUIRES ", " requires)
  list(JOIN PC_PRIVATE " " private)
  list(JOIN PC_LIBS " " libs)
  configure_file(${PROJECT_SOURCE_DIR}/packaging/qjulia.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
          COMPONENT ${component})
endfunction()
set(same "= ${PROJECT_VERSION}")
install_pkg_config(qjulia-field field_dev qjulia_field "Evaluates the maps of qjulia"
  REQUIRES eigen3 nlohmann_json PRIVATE OpenCL zlib fmt)
install_pkg_config(qjulia-mesh dev qjulia_mesh "Meshes of qjulia's maps, and maps of meshes"
  REQUIRES "qjulia-field ${same}" PRIVATE expat fmt LIBS -lOpenMeshTools -lOpenMeshCore -pthread)
install_pkg_config(qjulia-fit dev qjulia_fit "Fits the maps of qjulia to meshes"
  REQUIRES "qjulia-mesh ${same}" PRIVATE fmt LIBS -pthread)
install_pkg_config(qjulia-picture dev qjulia_picture "Pictures of qjulia's maps"
  REQUIRES "qjulia-mesh ${same}" PRIVATE libpng OpenEXR cairo fmt)
install_pkg_config(qjulia dev qjulia ${PROJECT_DESCRIPTION}
  REQUIRES "qjulia-fit ${same}" "qjulia-picture ${same}" PRIVATE fmt LIBS -pthread)

install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/cpp DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples
        COMPONENT dev FILES_MATCHING PATTERN *.cpp PATTERN CMakeLists.txt)

# Where their links lead to each other, as in the repository.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/python DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples
        COMPONENT doc FILES_MATCHING PATTERN *.py)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT doc)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/blender DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples
        COMPONENT doc FILES_MATCHING PATTERN *.py)
# The site, where the target docs has made it.
install(DIRECTORY ${PROJECT_BINARY_DIR}/docs/html DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT doc OPTIONAL)
install(FILES README.md CHANGELOG.md CONTRIBUTING.md CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT doc)
