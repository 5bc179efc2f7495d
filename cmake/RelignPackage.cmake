# cpack -G DEB, in a build folder: relign-bench_VERSION_amd64.deb, made of what `cmake --install` installs.
#
# Which libraries it depends on is read from the program and its plugins by dpkg-shlibdeps (Debian: dpkg-dev), so that
# a build without OpenCV's DNN module, Embree or Ceres depends on none of them.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "The relign-bench authors")
set(CPACK_PACKAGE_CONTACT "The relign-bench authors <relign-bench@localhost>")
set(CPACK_PACKAGE_DESCRIPTION
    "Moves a simulated lens in front of an image sensor until the picture is right, as a machine of a production line
does, and tells which algorithm needs how many images for it. Every algorithm meets the same lenses, starts, stage
errors and frame noise. With optimizers, trained agents, a report, and headers for plugins in C++ and Python.")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_CHECKSUM SHA256)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)  # cpack takes this machine's; ./quickstart aarch64 sets what else differs
endif()
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3, python3-numpy")  # plugins in Python
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "ffmpeg, cmake, g++, slurm-client")  # render -o FILE.mp4; plugins in C++; clusters
include(CPack)
