# What the libraries link; read by our own build and, installed, by find_package(dtr): static libraries
# need all of it again. CONFIG with names, so that a missing library is an error and not a smaller
# product. Expects DTR_WITH_GL, DTR_WITH_GLFW and DTR_WITH_OSG.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(SQLite3 3.34 REQUIRED)
find_package(OpenSSL 3 REQUIRED COMPONENTS Crypto)
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc calib3d features2d aruco video videoio ximgproc)
find_package(Ceres 2.1 REQUIRED)
find_package(OpenImageIO 2.4 REQUIRED)
find_package(JPEG REQUIRED)
find_package(PNG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(fmt 9 REQUIRED)
find_package(pugixml 1.13 REQUIRED)
find_package(hwy 1.0 REQUIRED)
# Vectors whose size is known when the program runs fit no struct and no array; ARM processors that
# have them have NEON too.
set(DTR_ARM_HIGHWAY_TARGETS "HWY_DISABLED_TARGETS=(HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128)")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)")
  set_property(TARGET hwy::hwy APPEND PROPERTY
    INTERFACE_COMPILE_DEFINITIONS "${DTR_ARM_HIGHWAY_TARGETS}")
endif()
find_package(PkgConfig REQUIRED)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd>=1.4)
# By pkg-config: libzip's own CMake files ask for its programs, which are other packages.
pkg_check_modules(LIBZIP REQUIRED IMPORTED_TARGET libzip>=1.7)
pkg_check_modules(FFMPEG REQUIRED IMPORTED_TARGET libavformat>=59 libavcodec>=59 libavfilter>=8
  libswscale>=6 libavutil>=57)  # FFmpeg 5.1
pkg_check_modules(LCMS2 REQUIRED IMPORTED_TARGET lcms2>=2.12)
if(DTR_WITH_GL)
  pkg_check_modules(EPOXY REQUIRED IMPORTED_TARGET epoxy>=1.5)
  pkg_check_modules(EGL REQUIRED egl)  # epoxy's EGL header includes EGL's own
  if(DTR_WITH_GLFW)
    find_package(glfw3 3.3 REQUIRED)
    pkg_check_modules(IMGUI REQUIRED IMPORTED_TARGET imgui>=1.86)
  endif()
endif()
include(${CMAKE_CURRENT_LIST_DIR}/OpenSceneGraph.cmake)
