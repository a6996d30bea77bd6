# `cmake --install`: the program with man page and completion (component runtime), OpenSceneGraph's
# plugin (osg), the libraries with headers and dtrConfig.cmake (dev), the Python package (python). `cpack`
# makes Debian packages: dtr of the first two, libdtr-dev of the third, python3-dtr of the last.
include(CMakePackageConfigHelpers)

install(TARGETS dtr RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)

# Both pages come from the program's own parser, so that they cannot fall behind it.
foreach(page manual completion)
  add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/dtr.${page}
    COMMAND dtr ${page} > ${PROJECT_BINARY_DIR}/dtr.${page} DEPENDS dtr VERBATIM)
endforeach()
add_custom_target(dtr_manual ALL DEPENDS ${PROJECT_BINARY_DIR}/dtr.1.gz ${PROJECT_BINARY_DIR}/dtr.completion)
install(FILES ${PROJECT_BINARY_DIR}/dtr.completion RENAME dtr
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT runtime)
install(FILES LICENSE RENAME copyright DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT runtime)
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT runtime)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT runtime FILES_MATCHING PATTERN "*.md"
  PATTERN images EXCLUDE PATTERN site EXCLUDE)
# Compressed as Debian asks; -n leaves the time out, so that equal pages are equal files.
add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/dtr.1.gz
  COMMAND gzip -9nc ${PROJECT_BINARY_DIR}/dtr.manual > ${PROJECT_BINARY_DIR}/dtr.1.gz
  DEPENDS ${PROJECT_BINARY_DIR}/dtr.manual VERBATIM)
install(FILES ${PROJECT_BINARY_DIR}/dtr.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime)

# DTR_PUBLIC_HEADERS, relative to the root: those of the libraries that do not call themselves internal in their first lines;
# of a folder of pipeline/ those that lie in it directly.
file(GLOB_RECURSE headers RELATIVE ${PROJECT_SOURCE_DIR}
  dtr/*.h capture/*.h calib/*.h stereo/*.h datasets/*.h viewer/*.h pipeline/*.h)
list(FILTER headers EXCLUDE REGEX "/(shaders|examples|plaza)/|^pipeline/[a-z]+/[a-z]+/")
foreach(feature IN LISTS DTR_FEATURES)
  if(NOT DTR_WITH_${feature})
    string(TOLOWER ${feature} folder)
    list(FILTER headers EXCLUDE REGEX "^pipeline/${folder}/")
  endif()
endforeach()
set(DTR_PUBLIC_HEADERS)
foreach(header ${headers})
  file(STRINGS ${PROJECT_SOURCE_DIR}/${header} lines LIMIT_COUNT 2)
  if(NOT lines MATCHES "[Ii]nternal")
    list(APPEND DTR_PUBLIC_HEADERS ${header})
    get_filename_component(folder ${header} DIRECTORY)
    install(FILES ${header} DESTINATION ${DTR_INSTALL_HEADERS}/${folder} COMPONENT dev)
  endif()
endforeach()
set(config ${CMAKE_INSTALL_LIBDIR}/cmake/dtr)
configure_package_config_file(cmake/dtrConfig.cmake.in ${PROJECT_BINARY_DIR}/dtrConfig.cmake
  INSTALL_DESTINATION ${config})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/dtrConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/dtrConfig.cmake ${PROJECT_BINARY_DIR}/dtrConfigVersion.cmake
  cmake/DtrDependencies.cmake cmake/OpenSceneGraph.cmake DESTINATION ${config} COMPONENT dev)
install(EXPORT dtrTargets NAMESPACE dtr:: DESTINATION ${config} COMPONENT dev)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "D+TR toolkit developers")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION
  "Calibrates and validates the cameras of a photo collection, computes depth maps
without CUDA, keeps the scene as a D+TR set (depth, texture, calibration) and
renders new views of it: to files, in a window, in OpenSceneGraph.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME dtr)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
# Programs that dtr runs; and the drivers that open a context where there is no screen, which --renderer
# auto does without.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "ffmpeg")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "colmap (>= 3.8), openscenegraph, libegl1, libgl1-mesa-dri, libegl-mesa0")
set(CPACK_DEBIAN_LIBRARIES_DESCRIPTION
  "Static libraries and headers to load, render and measure D+TR sets in programs of
one's own: find_package(dtr).")
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_NAME libdtr-dev)
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_SECTION libdevel)
# What scripts/packages.txt has of development files: the libraries are static.
file(STRINGS scripts/packages.txt packages REGEX "^(lib.*-dev|nlohmann-json3-dev|openimageio-tools|pkg-config)$")
list(FILTER packages EXCLUDE REGEX "gtest|gmock|cli11")
list(JOIN packages ", " packages)
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_DEPENDS "dtr (= ${PROJECT_VERSION}), ${packages}")
if(DTR_HAS_PYTHON)
  set(CPACK_DEBIAN_BINDINGS_DESCRIPTION
    "The Python package dtr: D+TR sets as numpy arrays without copies, new views of
them, and all jobs of the program (build, validate, evaluate, export) as calls.")
  set(CPACK_DEBIAN_BINDINGS_PACKAGE_NAME python3-dtr)
  set(CPACK_DEBIAN_BINDINGS_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_BINDINGS_PACKAGE_SHLIBDEPS ON)
  # The module is for one minor version of Python.
  math(EXPR next_python "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_BINDINGS_PACKAGE_DEPENDS "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next_python}), python3-numpy, ffmpeg")
  set(CPACK_DEBIAN_BINDINGS_PACKAGE_RECOMMENDS "python3-matplotlib, colmap (>= 3.8), libegl1, libgl1-mesa-dri, libegl-mesa0")
  set(CPACK_DEBIAN_BINDINGS_PACKAGE_SUGGESTS "dtr, jupyter-notebook")
endif()
include(CPack)
cpack_add_component(runtime GROUP program)
cpack_add_component(osg GROUP program)
cpack_add_component(dev GROUP libraries)
if(DTR_HAS_PYTHON)
  cpack_add_component(python GROUP bindings)
  cpack_add_component_group(bindings)
endif()
cpack_add_component_group(program)
cpack_add_component_group(libraries)
