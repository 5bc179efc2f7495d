# relign_add_room(NAME SOURCES file... [DEPENDS room_or_library...] [INCLUDES_ONLY])
#
# One room of core/ becomes one static library relign_NAME. Headers are included as
# "NAME/header.h" from core/. DEPENDS names what its headers or sources use.
function(relign_add_room name)
  cmake_parse_arguments(ROOM "" "" "SOURCES;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  add_library(relign_${name} STATIC ${ROOM_SOURCES})
  target_include_directories(relign_${name} PUBLIC "${PROJECT_SOURCE_DIR}/core")
  target_link_libraries(relign_${name} PUBLIC ${ROOM_DEPENDS} PRIVATE relign_compile ${ROOM_PRIVATE_DEPENDS})
endfunction()
