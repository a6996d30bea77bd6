# Target `docs`: all pages and the public headers as one site, PROJECT_BINARY_DIR/site/html/index.html; docs/site/ has what
# makes it. Needs Doxygen, and KaTeX (libjs-katex) for formulas that are drawn. Expects DTR_PUBLIC_HEADERS.

# In the order of the site; pages of docs/ that are not listed come last.
set(DTR_SITE_PAGES README.md
  docs/TUTORIAL.md docs/CAPTURE.md docs/IMPORT.md docs/DYNAMIC.md docs/VIEWER.md docs/EXPORT.md docs/PRUNING.md
  docs/PYTHON.md docs/PACKAGES.md docs/OSG.md
  docs/CALIBRATION.md docs/VALIDATION.md docs/BENCH.md
  docs/METHODS.md docs/RENDER_SPEC.md docs/FORMAT.md docs/CONVENTIONS.md docs/ARCHITECTURE.md
  docs/ACCURACY.md docs/accuracy/CAMERAS.md docs/accuracy/CALIBRATION.md docs/accuracy/DEPTH.md docs/accuracy/RENDERING.md docs/accuracy/SPEED.md
  docs/accuracy/TRIED.md
  docs/measurements/stability.md docs/SECURITY.md docs/FIELD_CASES.md
  docs/BACKGROUND.md datasets/plaza/README.md CONTRIBUTING.md CHANGELOG.md)
file(GLOB_RECURSE pages RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS docs/*.md)
list(REMOVE_ITEM pages ${DTR_SITE_PAGES})
list(APPEND DTR_SITE_PAGES ${pages})

find_program(DTR_DOXYGEN doxygen)
find_path(DTR_KATEX katex.min.js PATHS /usr/share/javascript/katex NO_DEFAULT_PATH)
if(NOT Python3_EXECUTABLE)
  find_package(Python3 3.9 QUIET COMPONENTS Interpreter)
endif()
if(DTR_DOXYGEN AND Python3_EXECUTABLE)
  list(JOIN DTR_SITE_PAGES " " DTR_SITE_INPUT)
  list(JOIN DTR_PUBLIC_HEADERS " " headers)
  string(APPEND DTR_SITE_INPUT " docs/site/full_text.dox ${headers}")
  set(DTR_DOXYFILE ${PROJECT_BINARY_DIR}/Doxyfile)
  configure_file(${PROJECT_SOURCE_DIR}/docs/site/Doxyfile.in ${DTR_DOXYFILE} @ONLY)
  # dtr_site_command(RESULT FOLDER): the command that makes the site in FOLDER.
  macro(dtr_site_command result folder)
    set(${result} ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/docs/site/build ${DTR_DOXYGEN} ${DTR_DOXYFILE} ${folder}
      $<$<BOOL:${DTR_KATEX}>:${DTR_KATEX}>)
  endmacro()
  dtr_site_command(command ${PROJECT_BINARY_DIR}/site)
  add_custom_target(docs COMMAND ${command} COMMAND_EXPAND_LISTS VERBATIM USES_TERMINAL)
else()
  add_custom_target(docs COMMAND ${CMAKE_COMMAND} -E echo "docs: needs Doxygen and Python: apt-get install doxygen libjs-katex python3, then configure again"
    COMMAND ${CMAKE_COMMAND} -E false VERBATIM)
endif()
