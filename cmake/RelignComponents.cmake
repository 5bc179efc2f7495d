# What is built: the harness (plugin interface, host, trials, suites, runner, records, statistics, report, verbs) and these
# components. RELIGN_HAS_NAME says for each whether it is, RELIGN_HAS_EVERYTHING whether all are;
# core/README.md lists lines and libraries of each.
set(RELIGN_ALL_COMPONENTS simulator gpu plugins leaderboard cluster training)
set(RELIGN_COMPONENTS "all" CACHE STRING
    "Components besides the harness: all, none, or a list of ${RELIGN_ALL_COMPONENTS}")
set(chosen ${RELIGN_COMPONENTS})
if(chosen STREQUAL "all")
  set(chosen ${RELIGN_ALL_COMPONENTS})
elseif(chosen STREQUAL "none")
  set(chosen "")
endif()
foreach(component ${chosen})
  if(NOT component IN_LIST RELIGN_ALL_COMPONENTS)
    message(FATAL_ERROR "RELIGN_COMPONENTS: '${component}' is not a component; allowed: all, none, or a list of "
                        "${RELIGN_ALL_COMPONENTS}")
  endif()
endforeach()
set(RELIGN_HAS_EVERYTHING ON)
foreach(component ${RELIGN_ALL_COMPONENTS})
  if(component IN_LIST chosen)
    set(RELIGN_HAS_${component} ON)
  else()
    set(RELIGN_HAS_${component} OFF)
    set(RELIGN_HAS_EVERYTHING OFF)
  endif()
endforeach()
if(RELIGN_HAS_gpu AND NOT RELIGN_HAS_simulator)
  message(FATAL_ERROR "RELIGN_COMPONENTS: 'gpu' needs 'simulator'")
endif()

# relign_component_definitions(TARGET): RELIGN_HAS_SIMULATOR=1 and so on, for what is built.
function(relign_component_definitions target)
  foreach(component ${RELIGN_ALL_COMPONENTS})
    string(TOUPPER ${component} name)
    target_compile_definitions(${target} PRIVATE RELIGN_HAS_${name}=$<BOOL:${RELIGN_HAS_${component}}>)
  endforeach()
endfunction()
