# relign_add_module(NAME [KERNELS] SOURCES file... [DEPENDS module_or_library...] [PRIVATE_DEPENDS ...])
#
# core/WING/NAME becomes one static library relign_NAME. Headers are included as "NAME/header.h" from core/WING, and the include
# root of a wing comes with the modules that a target depends on: what does not depend on a wing cannot include its headers.
# KERNELS: time is spent here. A release optimises such a module fully and the others for a short build.
function(relign_add_module name)
  cmake_parse_arguments(MODULE "KERNELS" "" "SOURCES;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  get_filename_component(wing "${CMAKE_CURRENT_SOURCE_DIR}" DIRECTORY)
  add_library(relign_${name} STATIC ${MODULE_SOURCES})
  target_include_directories(relign_${name} PUBLIC "${wing}")
  if(NOT MODULE_KERNELS)
    target_compile_options(relign_${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
  target_link_libraries(relign_${name} PUBLIC ${MODULE_DEPENDS} PRIVATE relign_compile ${MODULE_PRIVATE_DEPENDS})
endfunction()

# relign_add_part(NAME source... [LIBRARIES target...]): a part that an installation may lack (relign/optional_part.hpp).
function(relign_add_part name)
  cmake_parse_arguments(PART "" "" "LIBRARIES" ${ARGN})
  add_library(relign_part_${name} MODULE ${PART_UNPARSED_ARGUMENTS})
  set_target_properties(relign_part_${name} PROPERTIES OUTPUT_NAME "${name}" PREFIX "" SUFFIX ".so"
                        LIBRARY_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/lib/relign-bench/parts")
  target_include_directories(relign_part_${name} PRIVATE "${CMAKE_CURRENT_SOURCE_DIR}/..")
  target_link_libraries(relign_part_${name} PRIVATE relign_compile ${PART_LIBRARIES})
  set(prefix "")
  if(SKBUILD)  # into the Python package
    set(prefix relign_bench/)
  endif()
  install(TARGETS relign_part_${name} LIBRARY DESTINATION ${prefix}lib/relign-bench/parts COMPONENT plugins)
endfunction()

set(RELIGN_WINGS foundation simulator harness results analysis training)

# relign_embed_file(SYMBOL file OUT): OUT becomes a C source, made at build time, with the file's bytes as
# `const unsigned char SYMBOL[]` and their count `SYMBOL_size`.
function(relign_embed_file symbol file out)
  set(output "${CMAKE_CURRENT_BINARY_DIR}/${symbol}.c")
  set(script "${PROJECT_SOURCE_DIR}/cmake/embed_file.cmake")
  add_custom_command(OUTPUT "${output}"
    COMMAND "${CMAKE_COMMAND}" -D INPUT=${file} -D OUTPUT=${output} -D SYMBOL=${symbol} -P "${script}"
    DEPENDS "${file}" "${script}" VERBATIM)
  set(${out} "${output}" PARENT_SCOPE)
endfunction()

# relign_embed_schemas(TARGET name...): docs/schemas/NAME.schema.json as relign_schema_NAME, for base/schema.h.
function(relign_embed_schemas target)
  foreach(name ${ARGN})
    relign_embed_file(relign_schema_${name} "${PROJECT_SOURCE_DIR}/docs/schemas/${name}.schema.json" source)
    target_sources(${target} PRIVATE "${source}")
  endforeach()
endfunction()
