# Every third-party library, in one place. All come from Debian 12 packages (scripts/setup installs them).
# TBB comes before OpenVDB: OpenVDB's Find module looks for a target that only TBB's own config defines.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(TBB REQUIRED CONFIG)
find_package(ZLIB REQUIRED)
find_package(PNG REQUIRED)
# The headers alone: the package's CMake target also asks for xtl, which it does not need.
find_path(XSIMD_INCLUDE_DIR xsimd/xsimd.hpp REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(embree 3 REQUIRED)
find_package(Boost REQUIRED COMPONENTS iostreams)

# OpenVDB ships no CMake config, only a Find module.
find_path(OPENVDB_FIND_DIR FindOpenVDB.cmake PATH_SUFFIXES cmake/OpenVDB PATHS /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE} NO_CACHE)
list(APPEND CMAKE_MODULE_PATH ${OPENVDB_FIND_DIR})
find_package(OpenVDB 10 REQUIRED)

find_path(RANDOM123_INCLUDE_DIR Random123/philox.h REQUIRED)
find_path(NANOFLANN_INCLUDE_DIR nanoflann.hpp REQUIRED)
find_path(VALIJSON_INCLUDE_DIR valijson/validator.hpp REQUIRED)

if(MENISCUS_BUILD_APPS)
  find_package(CLI11 2.1 REQUIRED)
  find_package(fmt 9 REQUIRED)
endif()
if(MENISCUS_BUILD_TESTS)
  find_package(GTest REQUIRED)
  find_path(RAPIDCHECK_INCLUDE_DIR rapidcheck.h REQUIRED)
  find_library(RAPIDCHECK_LIBRARY rapidcheck REQUIRED)
endif()
