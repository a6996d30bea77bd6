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
find_package(nlohmann_json 3.11 REQUIRED)
find_package(fmt 9 REQUIRED)
find_package(hwy 1.0 REQUIRED)
if(DTR_WITH_GL)
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(EPOXY REQUIRED IMPORTED_TARGET epoxy>=1.5)
  pkg_check_modules(EGL REQUIRED egl)  # epoxy's EGL header includes EGL's own
  if(DTR_WITH_GLFW)
    find_package(glfw3 3.3 REQUIRED)
    pkg_check_modules(IMGUI REQUIRED IMPORTED_TARGET imgui>=1.86)
  endif()
endif()
include(${CMAKE_CURRENT_LIST_DIR}/OpenSceneGraph.cmake)
