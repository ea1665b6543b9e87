# What CPack leaves to be done to files of a package: static libraries are stripped of what no linker
# reads.
file(GLOB_RECURSE archives ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/*.a)
foreach(archive IN LISTS archives)
  execute_process(COMMAND strip --strip-debug --enable-deterministic-archives
                          --remove-section=.comment --remove-section=.note ${archive}
                  COMMAND_ERROR_IS_FATAL ANY)
endforeach()
