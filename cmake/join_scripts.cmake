# cmake -D OUTPUT=file -D INPUTS=a.js,b.js -P join_scripts.cmake: the scripts in one file, without comment lines and
# indentation, since every page contains it.
string(REPLACE "," ";" inputs "${INPUTS}")
set(joined "")
foreach(input IN LISTS inputs)
  file(READ "${input}" text)
  string(REGEX REPLACE "(^|\n) *//[^\n]*" "\\1" text "${text}")
  string(REGEX REPLACE "\n[ \n]+" "\n" text "${text}")
  string(APPEND joined "${text}")
endforeach()
file(WRITE "${OUTPUT}" "${joined}")
