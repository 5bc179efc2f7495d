# The output of `plugin new`, built against the installation, passes its own test and can be used.
include("${CMAKE_CURRENT_LIST_DIR}/stranger.cmake")
string(REPLACE "-" "_" name "new_${KIND}")
set(work "${PLACE}/new_${KIND}")
file(REMOVE_RECURSE "${work}")
file(MAKE_DIRECTORY "${work}")

run("${work}" relign-bench plugin new --kind ${KIND} --lang cpp ${name})
# No name of the template is left.
file(GLOB_RECURSE files "${work}/${name}/*")
foreach(file ${files})
  file(READ "${file}" text)
  if("${file}${text}" MATCHES "my_plugin|MyPlugin")
    message(FATAL_ERROR "${file} still contains ${CMAKE_MATCH_0}")
  endif()
endforeach()

build_and_test("${work}/${name}")

set(plugin ./${name}/build/${name})
try_plugin()
