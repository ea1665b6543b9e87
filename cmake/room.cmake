# qjulia_room(NAME [EXCEPT FILE…] [SOURCES FILE…] [LINKS ROOM…] [SEES ROOM…] [USES LIBRARY…]): this folder as
# the object library qjulia_NAME, of its .cpp files but those EXCEPTed, and of further SOURCES. The room
# itself and the rooms that link to it, directly or not, find its headers as "NAME/x.hpp", and no other room does:
# an include against the link lines does not compile. Of a room that it SEES it finds the headers too, but not
# those of the rooms that this one links to.
function(qjulia_room name)
  cmake_parse_arguments(ROOM "" "" "EXCEPT;SOURCES;LINKS;SEES;USES" ${ARGN})
  set(target qjulia_${name})
  set(root ${PROJECT_BINARY_DIR}/rooms/${name})
  file(MAKE_DIRECTORY ${root})
  file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR} ${root}/${name} SYMBOLIC)
  list(TRANSFORM ROOM_LINKS PREPEND qjulia_)

  file(GLOB sources CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} *.cpp)
  if(ROOM_EXCEPT)
    list(REMOVE_ITEM sources ${ROOM_EXCEPT})
  endif()
  add_library(${target} OBJECT ${sources} ${ROOM_SOURCES})
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  list(TRANSFORM ROOM_SEES PREPEND ${PROJECT_BINARY_DIR}/rooms/)
  target_include_directories(${target} PUBLIC ${root} ${ROOM_SEES})
  target_link_libraries(${target} PUBLIC qjulia_public ${ROOM_LINKS} PRIVATE qjulia_flags ${ROOM_USES})
endfunction()

# qjulia_embed(TARGET ROOT FOLDER FILES PATH… ROOM ROOM HEADER NAME NAMESPACE N FUNCTION F): an object
# library that holds the files' bytes under their paths from ROOT; N::F(), declared in ROOM/HEADER,
# gives them. So schedules and kernels travel inside the library.
function(qjulia_embed target)
  cmake_parse_arguments(EMBED "" "ROOT;ROOM;HEADER;NAMESPACE;FUNCTION" "FILES" ${ARGN})
  set(embedded ${CMAKE_CURRENT_BINARY_DIR}/${target}.cpp)
  list(TRANSFORM EMBED_FILES PREPEND ${EMBED_ROOT}/ OUTPUT_VARIABLE paths)
  set(script ${PROJECT_SOURCE_DIR}/cmake/embed.cmake)
  add_custom_command(
    OUTPUT ${embedded}
    COMMAND ${CMAKE_COMMAND} -DROOT=${EMBED_ROOT} "-DFILES=${EMBED_FILES}"
            -DHEADER=${EMBED_ROOM}/${EMBED_HEADER} -DNAMESPACE=${EMBED_NAMESPACE}
            -DFUNCTION=${EMBED_FUNCTION} -DOUTPUT=${embedded} -P ${script}
    DEPENDS ${paths} ${script}
    COMMENT "Embedding files: ${target}" VERBATIM)
  add_library(${target} OBJECT ${embedded})
  target_include_directories(${target} PRIVATE ${PROJECT_BINARY_DIR}/rooms/${EMBED_ROOM})
  target_link_libraries(${target} PRIVATE qjulia_flags)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
endfunction()
