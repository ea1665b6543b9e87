# QJULIA_DATE and QJULIA_TIME: the day of the commit that is built, and its time as mails have it. Outside a repository
# it is now. A build after another commit configures again. What the commit is, the build itself asks (commit.cmake).
string(TIMESTAMP QJULIA_DATE "%Y-%m-%d" UTC)
string(TIMESTAMP QJULIA_TIME "%a, %d %b %Y %H:%M:%S +0000" UTC)
if(EXISTS ${PROJECT_SOURCE_DIR}/.git)
  execute_process(COMMAND git log -1 "--format=%cs;%cD" WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
                  OUTPUT_VARIABLE origin OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  list(LENGTH origin parts)
  if(parts EQUAL 2)
    list(GET origin 0 QJULIA_DATE)
    list(GET origin 1 QJULIA_TIME)
    execute_process(COMMAND git rev-parse --path-format=absolute --git-path logs/HEAD
                    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE moves_of_head
                    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(EXISTS "${moves_of_head}")
      set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${moves_of_head})
    endif()
  endif()
endif()
