# relign_add_plugin(NAME source... [LIBRARIES target...] [DATA file_or_folder...] [FOLDER folder])
#
# Builds NAME.so from the sources and puts it, its manifest (relign-plugin.json beside the
# CMakeLists.txt) and its data files into one folder that the host can load: FOLDER, or NAME in the
# build folder. The manifest is embedded into the library byte for byte. Hidden visibility; one
# exported symbol. Works in relign-bench's own tree and after find_package(relign-bench).
#
# RELIGN_PLUGIN_INSTALL_DIRECTORY, when set, is where `cmake --install` puts the plugin's folder.
#
# relign_test_plugin(NAME [SCRIPT script.cmake])
#
# Tests of a plugin for CTest, with relign-bench itself: NAME_check is `relign-bench plugin check`. NAME_script
# runs SCRIPT, CMake code that runs trials and compares what they say; RelignTrials.cmake has the commands for it.
set(RELIGN_PLUGIN_CMAKE_DIR "${CMAKE_CURRENT_LIST_DIR}")

function(relign_add_plugin name)
  cmake_parse_arguments(PLUGIN "" "FOLDER" "LIBRARIES;DATA" ${ARGN})
  set(manifest "${CMAKE_CURRENT_SOURCE_DIR}/relign-plugin.json")
  if(NOT EXISTS "${manifest}")
    message(FATAL_ERROR "relign_add_plugin(${name}): ${manifest} is missing. Every plugin has a manifest beside its CMakeLists.txt.")
  endif()
  if(NOT PLUGIN_FOLDER)
    if(DEFINED RELIGN_PLUGIN_OUTPUT_DIRECTORY)
      set(PLUGIN_FOLDER "${RELIGN_PLUGIN_OUTPUT_DIRECTORY}/${name}")
    else()
      set(PLUGIN_FOLDER "${CMAKE_CURRENT_BINARY_DIR}/${name}")
    endif()
  endif()

  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${manifest}")
  file(READ "${manifest}" manifest_hex HEX)
  # Character constants: bytes above 127 are no `char` initialisers in C++.
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," manifest_bytes "${manifest_hex}")
  # A project may speak C alone or C++ alone.
  get_property(languages GLOBAL PROPERTY ENABLED_LANGUAGES)
  if("C" IN_LIST languages)
    set(embedded "${CMAKE_CURRENT_BINARY_DIR}/${name}_manifest.c")
    set(linkage "extern")
  else()
    set(embedded "${CMAKE_CURRENT_BINARY_DIR}/${name}_manifest.cpp")
    set(linkage "extern \"C\"")
  endif()
  file(CONFIGURE OUTPUT "${embedded}" CONTENT
"/* Generated from relign-plugin.json: the manifest's bytes, NUL-terminated. */
${linkage} const char relign_manifest_text[];
const char relign_manifest_text[] = {${manifest_bytes}0};
" @ONLY)

  set(target relign_plugin_${name})
  add_library(${target} MODULE ${PLUGIN_UNPARSED_ARGUMENTS} "${embedded}")
  set_target_properties(${target} PROPERTIES
    OUTPUT_NAME "${name}" PREFIX "" SUFFIX ".so"
    LIBRARY_OUTPUT_DIRECTORY "${PLUGIN_FOLDER}" RELIGN_PLUGIN_FOLDER "${PLUGIN_FOLDER}"
    C_VISIBILITY_PRESET hidden CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
    LINK_DEPENDS "${RELIGN_PLUGIN_CMAKE_DIR}/relign-plugin.map")
  target_link_options(${target} PRIVATE "LINKER:--version-script=${RELIGN_PLUGIN_CMAKE_DIR}/relign-plugin.map")
  target_link_libraries(${target} PRIVATE relign::plugin_api ${PLUGIN_LIBRARIES})
  if(TARGET relign_compile)
    target_link_libraries(${target} PRIVATE relign_compile)
  endif()

  # `relign-bench describe` points to it.
  if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/README.md")
    list(APPEND PLUGIN_DATA README.md)
  endif()

  # Manifest and data travel with the library; copied at build time so that an edit is enough.
  set(stamps "")
  foreach(item "${manifest}" ${PLUGIN_DATA})
    get_filename_component(item_path "${item}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_SOURCE_DIR}")
    get_filename_component(item_name "${item_path}" NAME)
    if(IS_DIRECTORY "${item_path}")
      file(GLOB_RECURSE inside CONFIGURE_DEPENDS RELATIVE "${item_path}" "${item_path}/*")
      foreach(file ${inside})
        add_custom_command(OUTPUT "${PLUGIN_FOLDER}/${item_name}/${file}"
          COMMAND "${CMAKE_COMMAND}" -E copy "${item_path}/${file}" "${PLUGIN_FOLDER}/${item_name}/${file}"
          DEPENDS "${item_path}/${file}" VERBATIM)
        list(APPEND stamps "${PLUGIN_FOLDER}/${item_name}/${file}")
      endforeach()
    else()
      add_custom_command(OUTPUT "${PLUGIN_FOLDER}/${item_name}"
        COMMAND "${CMAKE_COMMAND}" -E copy "${item_path}" "${PLUGIN_FOLDER}/${item_name}"
        DEPENDS "${item_path}" VERBATIM)
      list(APPEND stamps "${PLUGIN_FOLDER}/${item_name}")
    endif()
  endforeach()
  add_custom_target(${target}_files ALL DEPENDS ${stamps})
  add_dependencies(${target} ${target}_files)

  if(RELIGN_PLUGIN_INSTALL_DIRECTORY)
    set(destination "${RELIGN_PLUGIN_INSTALL_DIRECTORY}/${name}")
    install(TARGETS ${target} LIBRARY DESTINATION "${destination}" COMPONENT plugins)
    foreach(item "${manifest}" ${PLUGIN_DATA})
      get_filename_component(item_path "${item}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_SOURCE_DIR}")
      if(IS_DIRECTORY "${item_path}")
        install(DIRECTORY "${item_path}" DESTINATION "${destination}" COMPONENT plugins)
      else()
        install(FILES "${item_path}" DESTINATION "${destination}" COMPONENT plugins)
      endif()
    endforeach()
  endif()

  # One name for every plugin of a build: quickstart builds the program and its plugins without the tests.
  if(NOT TARGET relign_plugins)
    add_custom_target(relign_plugins)
  endif()
  add_dependencies(relign_plugins ${target})
endfunction()

function(relign_test_plugin name)
  cmake_parse_arguments(TEST "" "SCRIPT" "" ${ARGN})
  get_target_property(folder relign_plugin_${name} RELIGN_PLUGIN_FOLDER)
  add_test(NAME ${name}_check COMMAND relign::relign-bench plugin check "${folder}")
  if(TEST_SCRIPT)
    get_filename_component(script "${TEST_SCRIPT}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_SOURCE_DIR}")
    add_test(NAME ${name}_script
      COMMAND "${CMAKE_COMMAND}" "-DRELIGN_BENCH=$<TARGET_FILE:relign::relign-bench>"
              "-DPLUGIN_FOLDER=${folder}" "-DSCRIPT=${script}" -P "${RELIGN_PLUGIN_CMAKE_DIR}/RelignTrials.cmake")
  endif()
endfunction()
