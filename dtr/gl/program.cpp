#include "dtr/gl/program.h"

#include <algorithm>
#include <regex>
#include <sstream>

#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::gl {
namespace {

constexpr size_t kMaxShaderBytes = 1 << 20;  // a shader is a few kilobytes

/// One stage's text, with the files it came from by the numbers that #line gives them.
class Source {
 public:
  Source(const std::string& file, const std::vector<std::string>& defines,
         const std::string& folder)
      : folder_(folder) {
    text_ = "#version 430 core\n";
    for (const std::string& define : defines) text_ += "#define " + define + "\n";
    Append(file);
  }
  const std::string& text() const { return text_; }

  /// "0:12(5): error ..." (Mesa) and "0(12) : error ..." (NVIDIA) with the file's own name.
  std::string FirstError(const std::string& log) const {
    static const std::regex kPlace(R"((\d+)[:(](\d+)\)?)");
    std::smatch match;
    const std::string line = log.substr(0, log.find('\n'));
    if (!std::regex_search(line, match, kPlace)) return files_.front() + ": " + line;
    const auto number = static_cast<size_t>(std::stoul(match[1]));
    const std::string& file = number < files_.size() ? files_[number] : files_.front();
    return file + ":" + match[2].str() + ": " + match.suffix().str();
  }

 private:
  std::string Load(const std::string& file) const {
    // What C++ is compiled with, too, is no shader to be edited (deferred_limits.h).
    const bool in_folder = !folder_.empty() && !file.ends_with(".h");
    if (in_folder) return ReadFile(folder_ + "/" + file, kMaxShaderBytes);
    for (const EmbeddedShader& shader : EmbeddedShaders()) {
      if (shader.name == file) return std::string(shader.text);
    }
    throw Error("shader " + file + ": expected among the embedded shaders, found none");
  }

  void Append(const std::string& file) {
    if (std::find(files_.begin(), files_.end(), file) != files_.end()) return;
    const size_t number = files_.size();
    files_.push_back(file);
    std::istringstream lines(Load(file));
    std::string line;
    text_ += "#line 1 " + std::to_string(number) + "\n";
    for (int count = 1; std::getline(lines, line); ++count) {
      static const std::regex kInclude(R"rx(^\s*#include\s+"([^"]+)"\s*$)rx");
      std::smatch match;
      if (!std::regex_match(line, match, kInclude)) {
        text_ += line + "\n";
        continue;
      }
      Append(match[1]);
      text_ += "#line " + std::to_string(count + 1) + " " + std::to_string(number) + "\n";
    }
  }

  const std::string folder_;
  std::vector<std::string> files_;
  std::string text_;
};

template <typename GetParameter, typename GetLog>
std::string LogOf(GLuint name, const GetParameter& parameter, const GetLog& get_log) {
  GLint length = 0;
  parameter(name, GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<size_t>(std::max(length, 1)), '\0');
  get_log(name, length, nullptr, log.data());
  log.resize(std::char_traits<char>::length(log.c_str()));
  return log;
}

Shader Compile(const Stage& stage, const std::vector<std::string>& defines,
               const std::string& folder) {
  const Source source(stage.file, defines, folder);
  Shader shader(glCreateShader(stage.type));
  const char* text = source.text().c_str();
  glShaderSource(shader.name(), 1, &text, nullptr);
  glCompileShader(shader.name());
  GLint compiled = 0;
  glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_TRUE) return shader;
  throw Error("shader " +
              source.FirstError(LogOf(shader.name(), glGetShaderiv, glGetShaderInfoLog)) +
              "; use `renderer` cpu or simd");
}

}  // namespace

Program BuildProgram(const std::vector<Stage>& stages, const std::vector<std::string>& defines,
                     const std::string& shader_folder) {
  Program program = Program::Make();
  std::vector<Shader> shaders;
  for (const Stage& stage : stages) {
    shaders.push_back(Compile(stage, defines, shader_folder));
    glAttachShader(program.name(), shaders.back().name());
  }
  glLinkProgram(program.name());
  for (const Shader& shader : shaders) glDetachShader(program.name(), shader.name());
  GLint linked = 0;
  glGetProgramiv(program.name(), GL_LINK_STATUS, &linked);
  if (linked != GL_TRUE) {
    const std::string log = LogOf(program.name(), glGetProgramiv, glGetProgramInfoLog);
    throw Error("shader " + stages.front().file + ": does not link: " +
                log.substr(0, log.find('\n')) + "; use `renderer` cpu or simd");
  }
  return program;
}

const Program& ProgramCache::Get(const std::vector<Stage>& stages,
                                 const std::vector<std::string>& defines) {
  std::string key = stages.back().file;
  for (const std::string& define : defines) key += "|" + define;
  const auto found = programs_.find(key);
  if (found != programs_.end()) return found->second;
  return programs_.emplace(key, BuildProgram(stages, defines, shader_folder_)).first->second;
}

}  // namespace dtr::gl
