# QJULIA_COMMIT, QJULIA_DATE and QJULIA_TIME: the commit that is built, its day, and its time as mails have
# it. Outside a repository there is no commit, and it is now. A build after another commit configures again.
set(QJULIA_COMMIT "")
string(TIMESTAMP QJULIA_DATE "%Y-%m-%d" UTC)
string(TIMESTAMP QJULIA_TIME "%a, %d %b %Y %H:%M:%S +0000" UTC)
if(EXISTS ${PROJECT_SOURCE_DIR}/.git)
  execute_process(COMMAND git log -1 "--format=%h;%cs;%cD" --abbrev=12 WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
                  OUTPUT_VARIABLE origin OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  list(LENGTH origin parts)
  if(parts EQUAL 3)
    list(GET origin 0 QJULIA_COMMIT)
    list(GET origin 1 QJULIA_DATE)
    list(GET origin 2 QJULIA_TIME)
    execute_process(COMMAND git rev-parse --path-format=absolute --git-path logs/HEAD
                    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE moves_of_head
                    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(EXISTS "${moves_of_head}")
      set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${moves_of_head})
    endif()
  endif()
endif()
