# Copies examples/compass out of this tree and builds it against the installation.
include("${CMAKE_CURRENT_LIST_DIR}/stranger.cmake")
set(work "${PLACE}/compass")
file(REMOVE_RECURSE "${work}")
file(COPY "${SOURCE}/examples/compass" DESTINATION "${PLACE}")

run("${work}" "${CMAKE_COMMAND}" -S . -B build ${CONFIGURE} -Werror=dev)
run("${work}" "${CMAKE_COMMAND}" --build build)
run("${work}" relign-bench try ./build/compass --steps 3)
if(NOT said MATCHES "\n +3 ")
  message(FATAL_ERROR "expected three steps:\n${said}")
endif()
