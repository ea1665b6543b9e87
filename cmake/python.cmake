# Looks for what the Python package needs, and sets QJULIA_HAS_PYTHON where all of it is there. Of
# several Pythons it is the system's, whose packages are in dist-packages; -DPython3_EXECUTABLE=... asks
# for another.
if(NOT DEFINED Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "The Python that the package is built for")
endif()
find_package(Python3 3.9 COMPONENTS Interpreter Development.Module)
if(Python3_Development.Module_FOUND AND NOT DEFINED pybind11_DIR)
  # pip's package of pybind11 says where its files are.
  execute_process(COMMAND ${Python3_EXECUTABLE} -m pybind11 --cmakedir
    OUTPUT_VARIABLE found OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(IS_DIRECTORY "${found}")
    set(pybind11_DIR "${found}" CACHE PATH "pybind11's CMake files")
  endif()
endif()
find_package(pybind11 2.10 QUIET)
if(Python3_Interpreter_FOUND AND Python3_Development.Module_FOUND AND pybind11_FOUND)
  set(QJULIA_HAS_PYTHON TRUE)
else()
  message(STATUS "The Python package is not built: it needs Python's headers and pybind11")
endif()
