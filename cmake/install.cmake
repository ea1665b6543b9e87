# cmake --install: the command, the libraries, its headers, and what find_package(qjulia) reads.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/qjulia)

install(TARGETS qjulia_command)
install(TARGETS qjulia_field EXPORT qjulia_field_targets)
install(TARGETS qjulia EXPORT qjulia_targets)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/qjulia TYPE INCLUDE)
foreach(export qjulia_field_targets qjulia_targets)
  install(EXPORT ${export} NAMESPACE qjulia:: DESTINATION ${package_folder})
endforeach()

write_basic_package_version_file(${PROJECT_BINARY_DIR}/qjulia-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_SOURCE_DIR}/cmake/qjulia-config.cmake
              ${PROJECT_BINARY_DIR}/qjulia-config-version.cmake
        DESTINATION ${package_folder})
