# The output of `plugin new --lang python` passes its own test and can be used by its path.
include("${CMAKE_CURRENT_LIST_DIR}/stranger.cmake")
string(REPLACE "-" "_" name "new_${KIND}")
set(work "${PLACE}/new_${KIND}_python")
file(REMOVE_RECURSE "${work}")
file(MAKE_DIRECTORY "${work}")

run("${work}" relign-bench plugin new --kind ${KIND} --lang python ${name})
run("${work}/${name}" "${PYTHON}" test_${name}.py)
set(plugin ./${name}/${name}.py)
try_plugin()
