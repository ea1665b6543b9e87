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

install(TARGETS qjulia_field EXPORT qjulia_field_targets ARCHIVE COMPONENT dev)
install(TARGETS qjulia EXPORT qjulia_targets ARCHIVE COMPONENT dev)
install(TARGETS qjulia_field_shared qjulia_shared EXPORT qjulia_shared_targets
        LIBRARY COMPONENT runtime NAMELINK_COMPONENT dev)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/qjulia TYPE INCLUDE COMPONENT dev)
foreach(export qjulia_field_targets qjulia_targets qjulia_shared_targets)
  install(EXPORT ${export} NAMESPACE qjulia:: DESTINATION ${package_folder} COMPONENT dev)
endforeach()
write_basic_package_version_file(${PROJECT_BINARY_DIR}/qjulia-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_SOURCE_DIR}/cmake/qjulia-config.cmake
              ${PROJECT_BINARY_DIR}/qjulia-config-version.cmake
        DESTINATION ${package_folder} COMPONENT dev)
file(RELATIVE_PATH to_prefix /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
string(REGEX REPLACE "/$" "" to_prefix ${to_prefix})
foreach(name qjulia qjulia-field)
  configure_file(packaging/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
          COMPONENT dev)
endforeach()

install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/cpp DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples
        COMPONENT dev FILES_MATCHING PATTERN *.cpp PATTERN CMakeLists.txt)

# Where their links lead to each other, as in the repository.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/python DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples
        COMPONENT doc FILES_MATCHING PATTERN *.py)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT doc)
install(FILES README.md CHANGELOG.md CONTRIBUTING.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT doc)
