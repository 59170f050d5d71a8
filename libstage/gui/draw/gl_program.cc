// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/gl_program.hh"

#include <array>

namespace Stg::draw {

namespace {

GLuint Compile(GLenum type, const char* source, std::string* error) {
  const GLuint shader = glCreateShader(type);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  GLint good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good) return shader;
  std::array<char, 1024> log{};
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
  *error = log.data();
  glDeleteShader(shader);
  return 0;
}

}  // namespace

bool GlProgram::Build(const char* name, const char* vertex, const char* fragment,
                      std::string* error) {
  const GLuint first = Compile(GL_VERTEX_SHADER, vertex, error);
  const GLuint second = first ? Compile(GL_FRAGMENT_SHADER, fragment, error) : 0;
  if (second) {
    program_ = glCreateProgram();
    glAttachShader(program_, first);
    glAttachShader(program_, second);
    glBindAttribLocation(program_, kCorner, "corner");
    glBindAttribLocation(program_, kColor, "color");
    glBindAttribLocation(program_, kPlace, "place");
    glLinkProgram(program_);
    GLint good = 0;
    glGetProgramiv(program_, GL_LINK_STATUS, &good);
    if (!good) {
      std::array<char, 1024> log{};
      glGetProgramInfoLog(program_, static_cast<GLsizei>(log.size()), nullptr, log.data());
      *error = log.data();
      Delete();
    }
  }
  glDeleteShader(first);
  glDeleteShader(second);
  if (program_ == 0) *error = std::string("the shader of ") + name + " can't be built: " + *error;
  return program_ != 0;
}

void GlProgram::SetMatrix(const view::Matrix& matrix) const {
  std::array<float, 16> values;
  for (size_t i = 0; i < values.size(); i++) values[i] = static_cast<float>(matrix[i]);
  glUniformMatrix4fv(Uniform("matrix"), 1, GL_FALSE, values.data());
}

void GlProgram::Delete() {
  if (program_) glDeleteProgram(program_);
  program_ = 0;
}

void GlBuffer::Bind(GLenum target) {
  if (id_ == 0) glGenBuffers(1, &id_);
  glBindBuffer(target, id_);
}

void GlBuffer::Fill(GLenum target, const void* data, std::size_t bytes, GLenum usage) {
  Bind(target);
  glBufferData(target, static_cast<GLsizeiptr>(bytes), data, usage);
}

void GlBuffer::Delete() {
  if (id_) glDeleteBuffers(1, &id_);
  id_ = 0;
}

void DescribeAttribute(Attribute attribute, GLint count, GLenum type, std::size_t stride,
                       std::size_t offset, GLuint divisor) {
  glEnableVertexAttribArray(attribute);
  // OpenGL takes offsets into a buffer as pointers.
  const void* place = reinterpret_cast<const void*>(offset);
  if (type == GL_UNSIGNED_INT)
    glVertexAttribIPointer(attribute, count, type, static_cast<GLsizei>(stride), place);
  else
    glVertexAttribPointer(attribute, count, type, type == GL_UNSIGNED_BYTE,
                          static_cast<GLsizei>(stride), place);
  glVertexAttribDivisor(attribute, divisor);
}

void DisableAttributes() {
  for (const Attribute attribute : {kCorner, kColor, kPlace}) {
    glDisableVertexAttribArray(attribute);
    glVertexAttribDivisor(attribute, 0);
  }
}

}  // namespace Stg::draw
