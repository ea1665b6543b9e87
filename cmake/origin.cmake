# QJULIA_COMMIT and QJULIA_DATE: the commit that is configured, and its day; empty outside a repository.
set(QJULIA_COMMIT "")
set(QJULIA_DATE "")
if(EXISTS ${PROJECT_SOURCE_DIR}/.git)
  execute_process(COMMAND git log -1 "--format=%h;%cs" --abbrev=12 WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
                  OUTPUT_VARIABLE origin OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  list(LENGTH origin parts)
  if(parts EQUAL 2)
    list(GET origin 0 QJULIA_COMMIT)
    list(GET origin 1 QJULIA_DATE)
  endif()
endif()
