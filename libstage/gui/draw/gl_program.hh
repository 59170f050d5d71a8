// SPDX-License-Identifier: GPL-2.0-or-later
//
// Wrappers for shader programs and buffers of the current OpenGL context.

#ifndef STAGE_GUI_DRAW_GL_PROGRAM_HH
#define STAGE_GUI_DRAW_GL_PROGRAM_HH

#ifndef GL_GLEXT_PROTOTYPES
#define GL_GLEXT_PROTOTYPES
#endif
#include <GL/gl.h>
#include <GL/glext.h>

#include <string>

#include "gui/view/projection.hh"

namespace Stg::draw {

/// Vertex attribute locations, shared by all programs.
enum Attribute : GLuint { kCorner = 0, kColor = 1, kPlace = 2 };

class GlProgram {
 public:
  /// Compiles and links the shaders. Returns false and the driver's message on failure.
  bool Build(const char* name, const char* vertex, const char* fragment, std::string* error);
  void Use() const { glUseProgram(program_); }
  GLint Uniform(const char* name) const { return glGetUniformLocation(program_, name); }
  void SetMatrix(const view::Matrix& matrix) const;
  void Set(const char* name, float value) const { glUniform1f(Uniform(name), value); }
  void Set(const char* name, float x, float y) const { glUniform2f(Uniform(name), x, y); }
  void Set(const char* name, int value) const { glUniform1i(Uniform(name), value); }
  void Delete();

 private:
  GLuint program_ = 0;
};

/// A buffer that is refilled for each use.
class GlBuffer {
 public:
  void Bind(GLenum target);
  /// Binds the buffer and fills it.
  void Fill(GLenum target, const void* data, std::size_t bytes, GLenum usage = GL_STREAM_DRAW);
  GLuint id() const { return id_; }
  void Delete();

 private:
  GLuint id_ = 0;
};

/// Describes an attribute of the bound buffer. `offset` and `stride` are in bytes; divisor 1 means
/// one value per instance.
void DescribeAttribute(Attribute attribute, GLint count, GLenum type, std::size_t stride,
                       std::size_t offset, GLuint divisor = 0);
void DisableAttributes();

}  // namespace Stg::draw

#endif
