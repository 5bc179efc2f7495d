# cmake --install: the program, its plugins and what plugins outside this tree are built with.
#
# The program finds its parts relative to itself (../lib/relign-bench/plugins, ../share/relign-bench), so
# that an installation may be moved. That fixes those two places below the prefix; the rest follows
# GNUInstallDirs.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

if(NOT CMAKE_INSTALL_BINDIR STREQUAL "bin")
  message(FATAL_ERROR "CMAKE_INSTALL_BINDIR is ${CMAKE_INSTALL_BINDIR}; the program finds its plugins relative to "
                      "itself, so it must be bin.")
endif()

set(package_folder "${CMAKE_INSTALL_DATADIR}/cmake/relign-bench")

install(TARGETS relign-bench relign_plugin_api EXPORT relign-benchTargets
        RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
install(TARGETS relign-sandbox relign-library-host RUNTIME DESTINATION lib/relign-bench/bin)
install(DIRECTORY "${PROJECT_SOURCE_DIR}/core/plugin_api/relign" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}"
        FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
# Plugins install themselves: see RELIGN_PLUGIN_INSTALL_DIRECTORY in RelignPlugin.cmake.
install(DIRECTORY "${PROJECT_SOURCE_DIR}/templates" DESTINATION share/relign-bench)
install(DIRECTORY "${PROJECT_SOURCE_DIR}/docs/schemas" DESTINATION share/relign-bench)
if(EXISTS "${PROJECT_SOURCE_DIR}/python/relign_bench")
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/python/relign_bench" DESTINATION share/relign-bench/python
          FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "*.json" PATTERN "py.typed" PATTERN "__pycache__" EXCLUDE)
endif()

install(FILES LICENSE CITATION.cff cmake/copyright DESTINATION "${CMAKE_INSTALL_DOCDIR}")
# The copyright texts of what is compiled in (docs/licences.md), where the distribution's packages have them.
file(STRINGS cmake/embedded_packages.txt embedded)
foreach(package ${embedded})
  file(GLOB texts "${CMAKE_SYSROOT}/usr/share/doc/${package}/copyright")
  foreach(text ${texts})
    get_filename_component(folder "${text}" DIRECTORY)
    get_filename_component(package "${folder}" NAME)
    install(FILES "${text}" DESTINATION "${CMAKE_INSTALL_DOCDIR}/licenses" RENAME "${package}.txt")
  endforeach()
endforeach()
install(DIRECTORY suites examples DESTINATION share/relign-bench PATTERN "__pycache__" EXCLUDE)

# Where shells look for completions. The distribution's zsh has a folder of its own for packages, which have prefix /usr.
set(completions "${PROJECT_SOURCE_DIR}/core/cli/completion")
install(FILES "${completions}/relign-bench.bash" DESTINATION share/bash-completion/completions RENAME relign-bench)
install(FILES "${completions}/relign-bench.fish" DESTINATION share/fish/vendor_completions.d)
install(CODE "
  set(folder site-functions)
  if(\"\${CMAKE_INSTALL_PREFIX}\" MATCHES \"/usr$\")
    set(folder vendor-completions)
  endif()
  file(INSTALL \"${completions}/_relign-bench\" DESTINATION \"\${CMAKE_INSTALL_PREFIX}/share/zsh/\${folder}\")")

# The build folder has the package where an installation has it: -DCMAKE_PREFIX_PATH=BUILD_FOLDER works too.
set(package_here "${PROJECT_BINARY_DIR}/${package_folder}")
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/relign-benchConfig.cmake.in"
                              "${package_here}/relign-benchConfig.cmake" INSTALL_DESTINATION "${package_folder}")
# Before 1.0 the plugin interface may change with every minor version.
write_basic_package_version_file("${package_here}/relign-benchConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
foreach(file RelignPlugin.cmake RelignTrials.cmake relign-plugin.map)
  configure_file("${PROJECT_SOURCE_DIR}/cmake/${file}" "${package_here}/${file}" COPYONLY)
  install(FILES "${PROJECT_SOURCE_DIR}/cmake/${file}" DESTINATION "${package_folder}")
endforeach()
install(FILES "${package_here}/relign-benchConfig.cmake" "${package_here}/relign-benchConfigVersion.cmake"
        DESTINATION "${package_folder}")
install(EXPORT relign-benchTargets NAMESPACE relign:: DESTINATION "${package_folder}")
export(EXPORT relign-benchTargets NAMESPACE relign:: FILE "${package_here}/relign-benchTargets.cmake")

file(MAKE_DIRECTORY "${PROJECT_BINARY_DIR}/share/relign-bench")
foreach(folder templates suites)
  file(CREATE_LINK "${PROJECT_SOURCE_DIR}/${folder}" "${PROJECT_BINARY_DIR}/share/relign-bench/${folder}" SYMBOLIC)
endforeach()
