# Compiler settings shared by every target: target_link_libraries(... PRIVATE relign_compile).

set(CMAKE_CXX_STANDARD 20)  # plugins/CMakeLists.txt: 17 where the interface alone is used
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_STANDARD 11)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
string(REPLACE "-O3" "-O2" CMAKE_CXX_FLAGS_RELEASE "${CMAKE_CXX_FLAGS_RELEASE}")  # -O3: the block kernels of optics alone
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")

# Most of a file's compile time is its headers': several files of a target are compiled as one. The names of a module's
# unnamed namespaces must therefore be unique. Turn it off where one file changes again and again (the preset "dev" does).
option(CMAKE_UNITY_BUILD "Compile several source files of a target as one" ON)
set(CMAKE_UNITY_BUILD_BATCH_SIZE 8)

find_program(RELIGN_CCACHE ccache)
if(RELIGN_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_C_COMPILER_LAUNCHER "${RELIGN_CCACHE}")
  set(CMAKE_CXX_COMPILER_LAUNCHER "${RELIGN_CCACHE}")
endif()

add_library(relign_compile INTERFACE)
target_compile_options(relign_compile INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor> $<$<COMPILE_LANGUAGE:CXX>:-Woverloaded-virtual>
  # The compiler never fuses a multiplication and an addition by itself: images must be
  # bit-equal on every processor. Code that wants fma calls std::fma.
  -ffp-contract=off
  # What is not used is left out, of static libraries, too.
  $<$<CONFIG:Release>:-ffunction-sections> $<$<CONFIG:Release>:-fdata-sections>)
target_link_options(relign_compile INTERFACE "LINKER:--gc-sections,--as-needed,--exclude-libs,ALL")
# GCC 12 takes inlined std::string operations of C++20 for overlapping copies (GCC bug 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(relign_compile INTERFACE -Wno-restrict)
endif()
# Files compiled as one are included by a main file: their unnamed namespaces only look like a header's.
if(CMAKE_UNITY_BUILD AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(relign_compile INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-Wno-subobject-linkage>)
endif()
if(RELIGN_WARNINGS_AS_ERRORS)
  target_compile_options(relign_compile INTERFACE -Werror)
endif()
if(RELIGN_SANITIZE)
  target_compile_options(relign_compile INTERFACE -fsanitize=${RELIGN_SANITIZE} -fno-omit-frame-pointer
                         -fno-sanitize-recover=all)
  target_link_options(relign_compile INTERFACE -fsanitize=${RELIGN_SANITIZE})
endif()
if(RELIGN_COVERAGE)
  target_compile_options(relign_compile INTERFACE --coverage -fprofile-update=atomic)  # tests use threads
  target_link_options(relign_compile INTERFACE --coverage)
endif()
