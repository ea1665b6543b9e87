# qjulia_exports(TARGET PRIVATE NAMESPACE…): what a shared library shows: the names that stand in the
# namespace qjulia itself, under QJULIA_MAJOR.MINOR, which is what public headers declare. Names in
# namespaces within it, the rooms', are hidden, but those in PRIVATE ones, which other shared libraries
# of the same version need: they have a version of their own, as glibc's GLIBC_PRIVATE.
function(qjulia_exports target)
  if(APPLE)  # whose linker takes no such scripts
    return()
  endif()
  cmake_parse_arguments(EXPORTS "" "" "PRIVATE" ${ARGN})
  # Names as compilers mangle them (Itanium C++ ABI, 5.1): lengths before names, E at the end of what
  # is nested. A namespace's name begins with a small letter, a class's with a large one.
  set(public "")
  foreach(kind _ZN _ZNK _ZTIN _ZTSN _ZTVN _ZTTN)
    foreach(digits "[0-9]" "[0-9][0-9]")
      string(APPEND public "    ${kind}6qjulia${digits}[A-Z]*;\n")
    endforeach()
  endforeach()
  set(any "")
  foreach(length RANGE 1 48)
    string(APPEND any "?")
    string(APPEND public "    _ZN6qjulia${length}${any}E*;\n    _ZN6qjulia${length}${any}B5cxx11E*;\n")
  endforeach()
  string(APPEND public "    _ZN6qjulia[a-z][a-z]E*;\n")  # operators

  set(version ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  set(script "QJULIA_${version} {\n  global:\n${public}  local:\n    *;\n};\n")
  if(EXPORTS_PRIVATE)
    string(APPEND script "QJULIA_PRIVATE_${PROJECT_VERSION} {\n  global:\n")
    foreach(name IN LISTS EXPORTS_PRIVATE)
      string(LENGTH ${name} length)
      string(APPEND script "    _Z*N6qjulia${length}${name}[0-9]*;\n    _Z*NK6qjulia${length}${name}[0-9]*;\n")
    endforeach()
    string(APPEND script "};\n")
  endif()
  set(file ${CMAKE_CURRENT_BINARY_DIR}/${target}.map)
  file(CONFIGURE OUTPUT ${file} CONTENT "${script}" @ONLY)
  target_link_options(${target} PRIVATE LINKER:--version-script=${file})
  set_target_properties(${target} PROPERTIES LINK_DEPENDS ${file})
endfunction()
