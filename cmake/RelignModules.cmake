# relign_add_module(NAME SOURCES file... [DEPENDS module_or_library...] [PRIVATE_DEPENDS ...])
#
# core/WING/NAME becomes one static library relign_NAME. Headers are included as "NAME/header.h" from core/WING, and the include
# root of a wing comes with the modules that a target depends on: what does not depend on a wing cannot include its headers.
function(relign_add_module name)
  cmake_parse_arguments(MODULE "" "" "SOURCES;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  get_filename_component(wing "${CMAKE_CURRENT_SOURCE_DIR}" DIRECTORY)
  add_library(relign_${name} STATIC ${MODULE_SOURCES})
  target_include_directories(relign_${name} PUBLIC "${wing}")
  target_link_libraries(relign_${name} PUBLIC ${MODULE_DEPENDS} PRIVATE relign_compile ${MODULE_PRIVATE_DEPENDS})
endfunction()

set(RELIGN_WINGS foundation simulator harness results analysis)
