# Every outside library the project uses, found here and nowhere else.
# A missing one is reported with the distribution's package that brings it.

set(RELIGN_INSTALL_HINT "Install it, or run ./quickstart build, which installs what is missing.")

# Only what is used of a static library gets into the program. The shared OpenCV brings LAPACK and X11, libarchive ICU.
# Where the distribution has no static one, the shared one is linked. (Debian's static libtiff cannot be part of a plugin.)
option(RELIGN_STATIC "Link OpenCV and libarchive as static libraries where they are found" ON)

function(relign_require package debian_package)
  find_package(${package} ${ARGN} QUIET)
  if(NOT ${package}_FOUND)
    message(FATAL_ERROR "${package} was not found (Debian and Ubuntu: ${debian_package}). ${RELIGN_INSTALL_HINT}")
  endif()
endfunction()

# Makes the messages about services from their description, and runs tests. The distribution's, whose packages tests use; python3
# of the PATH may be another one.
find_program(RELIGN_DISTRIBUTION_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)
find_program(RELIGN_DISTRIBUTION_PYTHON python3)
if(NOT RELIGN_DISTRIBUTION_PYTHON)
  message(FATAL_ERROR "python3 (3.11 or later) was not found (Debian and Ubuntu: python3). ${RELIGN_INSTALL_HINT}")
endif()

relign_require(nlohmann_json nlohmann-json3-dev)
relign_require(simdjson libsimdjson-dev)
relign_require(CLI11 libcli11-dev)
relign_require(Eigen3 libeigen3-dev)
# Eigen cuts large products into blocks by the caches of the processor it meets, so that sums are taken in another order
# and end in other bits on another model. These sizes are any processor's (32 KiB, 512 KiB, 32 MiB), and the published results'.
set_property(TARGET Eigen3::Eigen APPEND PROPERTY INTERFACE_COMPILE_DEFINITIONS
  EIGEN_NO_CPUID EIGEN_DEFAULT_L1_CACHE_SIZE=32768 EIGEN_DEFAULT_L2_CACHE_SIZE=524288 EIGEN_DEFAULT_L3_CACHE_SIZE=33554432)
relign_require(NLopt "libnlopt-cxx-dev libnlopt-dev")
relign_require(OpenSSL libssl-dev)
if(RELIGN_HAS_leaderboard)
  relign_require(LibArchive libarchive-dev)
  find_library(RELIGN_STATIC_archive libarchive.a)
  find_library(RELIGN_ZSTD_LIBRARY zstd)
  find_library(RELIGN_LZMA_LIBRARY lzma)
  find_package(ZLIB QUIET)
  if(RELIGN_STATIC AND RELIGN_STATIC_archive AND RELIGN_ZSTD_LIBRARY AND RELIGN_LZMA_LIBRARY AND ZLIB_FOUND)
    set_target_properties(LibArchive::LibArchive PROPERTIES IMPORTED_LOCATION "${RELIGN_STATIC_archive}"
                          INTERFACE_LINK_LIBRARIES "${RELIGN_ZSTD_LIBRARY};${RELIGN_LZMA_LIBRARY};ZLIB::ZLIB")
  endif()
endif()

# Distribution functions of the statistics: headers of Boost.Math, nothing is linked.
find_path(RELIGN_BOOST_INCLUDE_DIR boost/math/distributions/students_t.hpp)
if(NOT RELIGN_BOOST_INCLUDE_DIR)
  message(FATAL_ERROR "Boost.Math was not found (Debian and Ubuntu: libboost-dev). ${RELIGN_INSTALL_HINT}")
endif()

# OpenCV's own CMake file comes with libopencv-dev alone, whose other modules weigh 600 MB. The two
# modules used here are found by themselves; CMAKE_PREFIX_PATH points to an OpenCV elsewhere.
find_path(RELIGN_OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
find_library(RELIGN_TBB_LIBRARY tbb)
# Used by tests alone, of features that need cv::solve.
find_library(RELIGN_LAPACK_LIBRARY NAMES lapack liblapack.so.3)
find_library(RELIGN_BLAS_LIBRARY NAMES blas libblas.so.3)
foreach(module core imgproc)
  find_library(RELIGN_OPENCV_${module}_LIBRARY opencv_${module})
  find_library(RELIGN_OPENCV_${module}_STATIC libopencv_${module}.a)
  if(NOT RELIGN_OPENCV_INCLUDE_DIR OR NOT RELIGN_OPENCV_${module}_LIBRARY)
    message(FATAL_ERROR "OpenCV's module ${module} was not found (Debian and Ubuntu: "
                        "libopencv-imgproc-dev). ${RELIGN_INSTALL_HINT}")
  endif()
  add_library(opencv_${module} UNKNOWN IMPORTED)
  set_target_properties(opencv_${module} PROPERTIES
    IMPORTED_LOCATION "${RELIGN_OPENCV_${module}_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${RELIGN_OPENCV_INCLUDE_DIR}")
endforeach()
if(RELIGN_STATIC AND RELIGN_OPENCV_core_STATIC AND RELIGN_OPENCV_imgproc_STATIC AND RELIGN_TBB_LIBRARY AND
   RELIGN_LAPACK_LIBRARY AND RELIGN_BLAS_LIBRARY)
  set_target_properties(opencv_core PROPERTIES IMPORTED_LOCATION "${RELIGN_OPENCV_core_STATIC}"
                        INTERFACE_LINK_LIBRARIES "relign_no_opengl;${RELIGN_TBB_LIBRARY};${RELIGN_LAPACK_LIBRARY};${RELIGN_BLAS_LIBRARY};z")
  set_target_properties(opencv_imgproc PROPERTIES IMPORTED_LOCATION "${RELIGN_OPENCV_imgproc_STATIC}"
                        INTERFACE_LINK_LIBRARIES opencv_core)
endif()

# Image files. OpenCV's imgcodecs would bring GDAL and a hundred libraries more.
relign_require(PNG libpng-dev)
relign_require(JPEG libjpeg-dev)
relign_require(TIFF libtiff-dev)
relign_require(GIF libgif-dev)
find_path(RELIGN_WEBP_INCLUDE_DIR webp/encode.h)
find_library(RELIGN_WEBP_LIBRARY webp)
if(NOT RELIGN_WEBP_INCLUDE_DIR OR NOT RELIGN_WEBP_LIBRARY)
  message(FATAL_ERROR "libwebp was not found (Debian and Ubuntu: libwebp-dev). ${RELIGN_INSTALL_HINT}")
endif()
add_library(relign_webp UNKNOWN IMPORTED)
set_target_properties(relign_webp PROPERTIES IMPORTED_LOCATION "${RELIGN_WEBP_LIBRARY}"
                      INTERFACE_INCLUDE_DIRECTORIES "${RELIGN_WEBP_INCLUDE_DIR}")

# Networks with operators that core/training/policies does not have. All else works without it.
if(RELIGN_HAS_training)
  find_library(RELIGN_OPENCV_dnn_LIBRARY opencv_dnn)
  find_path(RELIGN_OPENCV_DNN_INCLUDE_DIR opencv2/dnn.hpp PATH_SUFFIXES opencv4)
endif()
if(RELIGN_OPENCV_dnn_LIBRARY AND RELIGN_OPENCV_DNN_INCLUDE_DIR)
  add_library(opencv_dnn UNKNOWN IMPORTED)  # with the shared module core, on which it depends
  set_target_properties(opencv_dnn PROPERTIES IMPORTED_LOCATION "${RELIGN_OPENCV_dnn_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES "${RELIGN_OPENCV_DNN_INCLUDE_DIR}")
elseif(RELIGN_HAS_training)
  message(STATUS "Networks with operators other than relign-train's cannot be run: OpenCV's module dnn was not found "
                 "(Debian and Ubuntu: libopencv-dnn-dev)")
endif()

find_package(Threads REQUIRED)

# Meshes of lenses: read by assimp, traced by Embree. All else works without them.
if(RELIGN_HAS_simulator)
  find_package(assimp QUIET)
  find_package(embree 3 QUIET)
endif()
if(assimp_FOUND AND embree_FOUND)
  set(RELIGN_HAS_MESHES ON)
else()
  set(RELIGN_HAS_MESHES OFF)
  if(RELIGN_HAS_simulator)
    message(STATUS "Meshes of lenses are left out (room mesh, scene plugin lens_mesh): assimp or Embree 3 was not found "
                   "(Debian and Ubuntu: libassimp-dev libembree-dev)")
  endif()
endif()

# Levenberg-Marquardt (optimizer ceres): one header of Ceres, nothing is linked. All else works without it.
if(RELIGN_HAS_plugins)
  find_path(RELIGN_CERES_INCLUDE_DIR ceres/tiny_solver.h)
endif()
if(RELIGN_HAS_plugins AND NOT RELIGN_CERES_INCLUDE_DIR)
  message(STATUS "The optimizer ceres is left out: Ceres was not found (Debian and Ubuntu: libceres-dev)")
endif()

if(RELIGN_BUILD_TESTS)
  relign_require(GTest "libgtest-dev libgmock-dev")
endif()
if(RELIGN_BUILD_BENCHMARKS)
  relign_require(benchmark libbenchmark-dev)
endif()
