# Writes OUTPUT, a C++ file with the text of each of FILES: cmake -DOUTPUT=... -DFILES=... -P this.
set(body "")
foreach(file IN LISTS FILES)
  file(READ "${file}" text)
  get_filename_component(name "${file}" NAME)
  string(APPEND body "      {\"${name}\", R\"webfile(${text})webfile\"},\n")
endforeach()
file(WRITE "${OUTPUT}" "// Made from viewer/web by cmake/EmbedWebFiles.cmake.
#include \"viewer/web/web_files.h\"

namespace dtr::web {

const std::vector<WebFile>& WebFiles() {
  static const std::vector<WebFile> files = {
${body}  };
  return files;
}

}  // namespace dtr::web
")
