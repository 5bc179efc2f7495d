# Toolchain file: cross-compiles for aarch64 with Debian's g++-aarch64-linux-gnu against libraries of Debian's arm64 packages,
# unpacked into a root (python/debian_root.py; ./quickstart aarch64 does it). Tests and programs run in it by qemu-aarch64.
# Without meshes: the CMake file of Debian's draco, below assimp, has absolute paths.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../build/aarch64-root/root")
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -L "${CMAKE_SYSROOT}")
# Debian 12's Python.
set(Python_INCLUDE_DIR "${CMAKE_SYSROOT}/usr/include/python3.11")
set(PYTHON_MODULE_EXTENSION .cpython-311-aarch64-linux-gnu.so)
