// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/offscreen/context.hh"

#include "gui/draw/gl_program.hh"

#ifdef STAGE_HAVE_EGL

#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <algorithm>
#include <vector>

namespace Stg::offscreen {

struct Context::Impl {
  EGLDisplay display = EGL_NO_DISPLAY;
  EGLContext context = EGL_NO_CONTEXT;
  EGLSurface surface = EGL_NO_SURFACE;
  int width = 0, height = 0;
  std::string device;
  // Rendering uses a multisampled framebuffer; Read() resolves it into a single-sampled one.
  GLuint many[2] = {0, 0}, many_frame = 0, one = 0, one_frame = 0;

  ~Impl() {
    if (display == EGL_NO_DISPLAY) return;
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (surface != EGL_NO_SURFACE) eglDestroySurface(display, surface);
    if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
    eglTerminate(display);
  }
};

namespace {

constexpr GLint kSamples = 4;

bool Has(const char* list, const char* name) {
  return list &&
         (" " + std::string(list) + " ").find(" " + std::string(name) + " ") != std::string::npos;
}

/// Returns the candidate displays, best first.
std::vector<EGLDisplay> Displays() {
  std::vector<EGLDisplay> displays;
  const auto get = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(
      eglGetProcAddress("eglGetPlatformDisplayEXT"));
  const auto devices =
      reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const auto add = [&](EGLenum platform, void* native) {
    const EGLDisplay display = get(platform, native, nullptr);
    if (display != EGL_NO_DISPLAY) displays.push_back(display);
  };
  if (get && devices && Has(extensions, "EGL_EXT_platform_device")) {
    EGLDeviceEXT list[16];
    EGLint count = 0;
    if (devices(16, list, &count))
      for (EGLint i = 0; i < count; i++) add(EGL_PLATFORM_DEVICE_EXT, list[i]);
  }
  if (get && Has(extensions, "EGL_MESA_platform_surfaceless"))
    add(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY);
  displays.push_back(eglGetDisplay(EGL_DEFAULT_DISPLAY));
  return displays;
}

bool MakeCurrent(EGLDisplay display, EGLContext* context, EGLSurface* surface) {
  const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                           EGL_OPENGL_BIT,   EGL_RED_SIZE,    8,
                           EGL_NONE};
  EGLConfig config;
  EGLint count = 0;
  if (!eglBindAPI(EGL_OPENGL_API) || !eglChooseConfig(display, wanted, &config, 1, &count) ||
      count == 0)
    return false;
  const EGLint compatible[] = {EGL_CONTEXT_OPENGL_PROFILE_MASK,
                               EGL_CONTEXT_OPENGL_COMPATIBILITY_PROFILE_BIT, EGL_NONE};
  *context = eglCreateContext(display, config, EGL_NO_CONTEXT, compatible);
  if (*context == EGL_NO_CONTEXT)
    *context = eglCreateContext(display, config, EGL_NO_CONTEXT, nullptr);
  if (*context == EGL_NO_CONTEXT) return false;
  if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, *context)) return true;
  const EGLint tiny[] = {EGL_WIDTH, 16, EGL_HEIGHT, 16, EGL_NONE};
  *surface = eglCreatePbufferSurface(display, config, tiny);
  return *surface != EGL_NO_SURFACE && eglMakeCurrent(display, *surface, *surface, *context);
}

GLuint Renderbuffer(GLsizei samples, GLenum format, int width, int height) {
  GLuint id = 0;
  glGenRenderbuffers(1, &id);
  glBindRenderbuffer(GL_RENDERBUFFER, id);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, width, height);
  return id;
}

bool MakeFramebuffers(int width, int height, GLuint many[2], GLuint* many_frame, GLuint* one,
                      GLuint* one_frame) {
  GLint max_samples = 1;
  glGetIntegerv(GL_MAX_SAMPLES, &max_samples);
  const GLsizei samples = std::min(kSamples, max_samples);
  many[0] = Renderbuffer(samples, GL_RGBA8, width, height);
  many[1] = Renderbuffer(samples, GL_DEPTH_COMPONENT24, width, height);
  *one = Renderbuffer(0, GL_RGBA8, width, height);
  glGenFramebuffers(1, one_frame);
  glBindFramebuffer(GL_FRAMEBUFFER, *one_frame);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, *one);
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) return false;
  glGenFramebuffers(1, many_frame);
  glBindFramebuffer(GL_FRAMEBUFFER, *many_frame);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, many[0]);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, many[1]);
  return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

}  // namespace

std::unique_ptr<Context> Context::Make(int width, int height, std::string* error) {
  *error = "no OpenGL without a display: EGL offers none; install libegl-mesa0 and libgl1-mesa-dri";
  for (const EGLDisplay display : Displays()) {
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr)) continue;
    auto impl = std::make_unique<Impl>();
    impl->display = display;
    if (!MakeCurrent(display, &impl->context, &impl->surface)) continue;
    const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    impl->device = name ? name : "unknown";
    impl->width = width;
    impl->height = height;
    if (!MakeFramebuffers(width, height, impl->many, &impl->many_frame, &impl->one,
                          &impl->one_frame)) {
      *error = impl->device + " can't make pictures of " + std::to_string(width) + " by " +
               std::to_string(height) + " pixels";
      continue;
    }
    return std::unique_ptr<Context>(new Context(std::move(impl)));
  }
  return nullptr;
}

void Context::Bind() { glBindFramebuffer(GL_FRAMEBUFFER, impl_->many_frame); }

void Context::Read(Image* image) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, impl_->many_frame);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, impl_->one_frame);
  glBlitFramebuffer(0, 0, impl_->width, impl_->height, 0, 0, impl_->width, impl_->height,
                    GL_COLOR_BUFFER_BIT, GL_NEAREST);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, impl_->one_frame);
  ReadPixels(impl_->width, impl_->height, image);
  Bind();
}

}  // namespace Stg::offscreen

#else  // without EGL

namespace Stg::offscreen {

struct Context::Impl {
  int width = 0, height = 0;
  std::string device;
};

std::unique_ptr<Context> Context::Make(int, int, std::string* error) {
  *error = "this build has no EGL, which pictures without a display need";
  return nullptr;
}
void Context::Bind() {}
void Context::Read(Image*) {}

}  // namespace Stg::offscreen

#endif

namespace Stg::offscreen {

Context::Context(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Context::~Context() = default;
int Context::width() const { return impl_->width; }
int Context::height() const { return impl_->height; }
const std::string& Context::device() const { return impl_->device; }

}  // namespace Stg::offscreen
