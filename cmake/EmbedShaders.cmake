# Writes OUTPUT, a C++ file with the text of each of FILES: cmake -DOUTPUT=... -DFILES=... -P this.
set(body "")
foreach(file IN LISTS FILES)
  file(READ "${file}" text)
  get_filename_component(name "${file}" NAME)
  string(APPEND body "      {\"${name}\", R\"glsl(${text})glsl\"},\n")
endforeach()
file(WRITE "${OUTPUT}" "// Made from dtr/gl/shaders and what they include by cmake/EmbedShaders.cmake.
#include \"dtr/gl/program.h\"

namespace dtr::gl {

std::vector<EmbeddedShader> EmbeddedShaders() {
  return {
${body}  };
}

}  // namespace dtr::gl
")
