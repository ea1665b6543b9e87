# Writes the header OUTPUT with QJULIA_COMMIT, the commit that is checked out in SOURCE: "-dirty" behind it says that
# files of the repository differ from it, and it is empty outside a repository. A header that says so already stays as
# it is, so that nothing is compiled anew. Usage: cmake -DSOURCE=FOLDER -DOUTPUT=FILE -P commit.cmake
set(commit "")
if(EXISTS ${SOURCE}/.git)
  execute_process(COMMAND git describe --always --abbrev=12 --dirty --exclude=* WORKING_DIRECTORY ${SOURCE}
                  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#define QJULIA_COMMIT \"${commit}\"\n" @ONLY)
