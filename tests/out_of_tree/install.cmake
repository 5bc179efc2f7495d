# Installs the build and moves the installation, so that nothing can depend on its first place.
file(REMOVE_RECURSE "${PLACE}")
execute_process(COMMAND "${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${PLACE}/first"
                OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(RENAME "${PLACE}/first" "${PLACE}/moved")

# It finds its plugins without options.
execute_process(COMMAND "${PLACE}/moved/bin/relign-bench" list --json
                OUTPUT_VARIABLE listed ERROR_VARIABLE said COMMAND_ERROR_IS_FATAL ANY)
foreach(id lens_system rho nlopt random home)
  if(NOT listed MATCHES "\"${id}\"")
    message(FATAL_ERROR "the installed program does not list ${id}:\n${listed}\n${said}")
  endif()
endforeach()
if(said)
  message(FATAL_ERROR "the installed program printed: ${said}")
endif()

# The completions for shells are installed below the prefix.
foreach(file bash-completion/completions/relign-bench zsh/site-functions/_relign-bench
        fish/vendor_completions.d/relign-bench.fish)
  if(NOT EXISTS "${PLACE}/moved/share/${file}")
    message(FATAL_ERROR "there is no share/${file}")
  endif()
endforeach()
